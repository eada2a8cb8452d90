#include "nav/tspi_buffer.hpp"

namespace cyclops {
namespace {

Duration distance(Time a, Time b) { return a < b ? b - a : a - b; }

}  // namespace

TspiBuffer::TspiBuffer(const NavConfig& config, std::size_t history) : config_(config), items_(history) {
  CYCLOPS_ASSERT(history >= kProof);
}

void TspiBuffer::clear() {
  head_ = size_ = 0;
  held_.clear();
}

const Tspi& TspiBuffer::operator[](std::size_t i) const {
  CYCLOPS_ASSERT(i < size_);
  return items_[(head_ + i) % items_.size()];
}

Admission TspiBuffer::push(const Tspi& sample) {
  if (size_ != 0 && distance(sample.t, newest().t) > Duration::from_seconds(config_.max_jump_s)) return hold_back(sample);
  held_.clear();
  return insert(sample);
}

std::size_t TspiBuffer::first_at_or_after(Time t) const {
  std::size_t low = 0, high = size_;
  while (low < high) {
    const std::size_t mid = (low + high) / 2;
    if ((*this)[mid].t < t) low = mid + 1;
    else high = mid;
  }
  return low;
}

bool TspiBuffer::duplicate(const Tspi& sample, std::size_t i) const {
  if (i < size_ && ((*this)[i].t == sample.t || (*this)[i].seq == sample.seq)) return true;
  return i > 0 && (*this)[i - 1].seq == sample.seq;
}

void TspiBuffer::count_seq(const Tspi& sample) {
  const auto step = static_cast<std::int32_t>(sample.seq - newest().seq);  // wraps as the sender's counter does
  if (step <= 0) ++counters_.seq_restart;
  if (step <= 1) return;
  ++counters_.seq_gap;
  counters_.missing += static_cast<std::uint64_t>(step - 1);
}

Admission TspiBuffer::insert(const Tspi& sample) {
  std::size_t i = first_at_or_after(sample.t);
  if (duplicate(sample, i)) { ++counters_.duplicate; return Admission::kDuplicate; }
  const bool full = size_ == items_.size();
  if (full && i == 0) { ++counters_.too_old; return Admission::kTooOld; }
  const bool late = i < size_;
  if (!late && size_ != 0) count_seq(sample);
  if (full) { head_ = (head_ + 1) % items_.size(); --size_; --i; }
  ++size_;
  for (std::size_t k = size_ - 1; k > i; --k) item(k) = item(k - 1);
  item(i) = sample;
  ++counters_.accepted;
  if (late) ++counters_.out_of_order_inserted;
  return late ? Admission::kInsertedLate : Admission::kAccepted;
}

Admission TspiBuffer::hold_back(const Tspi& sample) {
  if (!held_.empty() && (held_.back().t == sample.t || held_.back().seq == sample.seq)) {
    ++counters_.duplicate;
    return Admission::kDuplicate;
  }
  if (!held_.empty() && distance(sample.t, held_.back().t) > Duration::from_seconds(config_.max_jump_s)) held_.clear();
  held_.push_back(sample);
  ++counters_.held_back;
  if (!held_.full()) return Admission::kHeldBack;
  const bool back = sample.t < newest().t;
  ++(back ? counters_.jump_back : counters_.jump_forward);
  if (back) head_ = size_ = 0;
  for (const Tspi& s : held_) insert(s);
  held_.clear();
  return Admission::kAccepted;
}

TspiBuffer::Answer TspiBuffer::at(Time t) const {
  if (size_ == 0) return {};
  const std::size_t i = first_at_or_after(t);
  const Tspi* after = i < size_ ? &(*this)[i] : nullptr;
  const Tspi* before = i > 0 ? &(*this)[i - 1] : nullptr;
  if (after != nullptr && after->t == t) return {Kind::kInterpolated, {}, predict(*after, t, config_)};
  if (after != nullptr && before != nullptr && after->t - before->t <= Duration::from_ms(config_.max_gap_ms))
    return {Kind::kInterpolated, t - after->t, interpolate(*before, *after, t, config_)};
  const bool forward = after == nullptr || (before != nullptr && t - before->t <= after->t - t);
  const Tspi& nearest = forward ? *before : *after;
  const Duration age = t - nearest.t;
  if (distance(t, nearest.t) > Duration::from_ms(config_.max_age_ms)) return {Kind::kTooFar, age, {}};
  return {Kind::kPredicted, age, predict(nearest, t, config_)};
}

}  // namespace cyclops
