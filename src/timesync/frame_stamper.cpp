#include "timesync/frame_stamper.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace cyclops {
namespace {

constexpr int kBesideInARow = 5;
constexpr double kQuiet = 0.3;                // spread of arrival - tick, part of the period
constexpr std::int64_t kStartReaches = 500;   // periods over which the number of the first frame can be extrapolated

}  // namespace

FrameStamper::FrameStamper(const FrameStamperConfig& config)
    : config_(config), line_(config.clock), period_ns_(static_cast<double>(config.period.ns)) {
  CYCLOPS_ASSERT(config.validated().ok());
  if (config_.transport_max.ns == 0) config_.transport_max = Duration{config_.period.ns * 4 / 5};
}

// --- one decision after the other --------------------------------------------------------------------------------

void FrameStamper::run() {
  while (!waiting_.empty() && (locked_ ? follow() : acquire())) {}
}

// Waiting is bounded; once it was in vain, later frames do not wait at all until an edge comes.
bool FrameStamper::may_wait() {
  if (!starved_ && waiting_.size() >= static_cast<std::size_t>(config_.max_wait_frames)) {
    starved_ = true;
    ++counters_.starved;
  }
  return !starved_ && !flushing_;
}

bool FrameStamper::follow() {
  const Entry f = waiting_.front();
  if (f.number == 0) { give_up_front(); return true; }
  if (const auto cause = contradiction(f, last_frame_)) { unlock(*cause); return true; }
  const Search found = find_edge(f);
  if (!found.edge && !found.complete && may_wait()) return false;
  if (found.edge && !counts_agree(f, *found.edge)) { unlock(LockLoss::kCount); return true; }
  switch (arrivals_say()) {
    case Proof::kRight: break;
    case Proof::kWrong: unlock(LockLoss::kLateArrival); return true;
    case Proof::kLater: if (!flushing_) return false; [[fallthrough]];
    case Proof::kNever: without_proof(f, found); return true;
  }
  if (!found.edge) return without_edge(f, found);
  pass_edges(found, *found.edge);
  waiting_.pop_front();
  confirm(f, *found.edge);
  emit_edge(f, *found.edge);
  return true;
}

std::optional<LockLoss> FrameStamper::contradiction(const Entry& f, const Pair& before) const {
  if (f.number <= before.number) return LockLoss::kNumberBack;
  const double steps = static_cast<double>(f.number - before.number);
  const double off = static_cast<double>(f.info.camera_tick_ns - before.tick_ns) - steps * period_ns_;
  if (std::abs(off) > 2 * static_cast<double>(config_.residual_max.ns) + 1e-3 * steps * period_ns_) return LockLoss::kTickStep;
  const Time exposed = line_.at(f.info.camera_tick_ns) - config_.edge_delay + f.info.exposure;
  if (f.info.t_arrival.ns != 0 && f.info.t_arrival < exposed - config_.arrival_slack) return LockLoss::kEarlyArrival;
  return std::nullopt;
}

bool FrameStamper::counts_agree(const Entry& f, Time edge) const {
  const double period = period_ns_ * (1 + line_.rate_ppm() * 1e-6);   // the edges are on the service clock
  const std::int64_t edges = std::llround(static_cast<double>((edge - last_pair_.edge).ns) / period);
  return edges == static_cast<std::int64_t>(f.number - last_pair_.number);
}

Duration FrameStamper::tolerance(const Entry& f) const {
  const double largest = static_cast<double>(config_.residual_max.ns);
  if (line_.pairs() < 16) return config_.residual_max;
  const double usual = 6 * line_.rms_ns() + 3 * static_cast<double>(line_.sigma_at(f.info.camera_tick_ns).ns);
  return {std::llround(std::clamp(usual, largest / 8, largest))};
}

FrameStamper::Search FrameStamper::find_edge(const Entry& f) const {
  const Time expected = line_.at(f.info.camera_tick_ns);
  const Duration within = tolerance(f);
  Search s;
  for (s.next = next_edge_; s.next < edges_.end_index(); ++s.next) {
    const Duration off = edges_[s.next].t - expected;
    const Duration distance{std::llabs(off.ns)};
    if (distance <= within) { s.edge = edges_[s.next++].t; return s; }
    if (static_cast<double>(distance.ns) < period_ns_ / 4 && (!s.beside || distance < *s.beside)) s.beside = distance;
    if (off > within) { s.complete = true; return s; }
  }
  return s;
}

// Counts the edges that no frame took.
void FrameStamper::pass_edges(const Search& search, Time expected) {
  const std::uint64_t end = search.edge ? search.next - 1 : search.next;
  for (std::uint64_t i = next_edge_; i < end; ++i) {
    if (i > edges_.begin_index() && (edges_[i].t - edges_[i - 1].t).ns < config_.period.ns / 8) continue;   // counted as doubled
    const double steps = static_cast<double>((edges_[i].t - expected).ns) / period_ns_;
    ++(std::abs(steps - std::round(steps)) < 0.125 && std::round(steps) != 0 ? counters_.edges_without_frame : counters_.edges_spurious);
  }
  next_edge_ = search.next;
}

bool FrameStamper::without_edge(const Entry& f, const Search& search) {
  if (search.beside && ++beside_in_a_row_ >= kBesideInARow) { unlock(LockLoss::kResidual); return true; }
  if (line_.age_at(f.info.camera_tick_ns) > config_.tick_holdover) { unlock(LockLoss::kHoldover); return true; }
  ++(search.beside ? counters_.no_edge_beside : search.complete ? counters_.no_edge_lost : counters_.no_edge_waited);
  pass_edges(search, line_.at(f.info.camera_tick_ns));
  waiting_.pop_front();
  emit_tick(f, search.beside.value_or(Duration{}));
  return true;
}

// --- locking -----------------------------------------------------------------------------------------------------

LockGates FrameStamper::gates() const {
  return {config_.edge_delay, config_.transport_max, config_.arrival_slack, config_.residual_max};
}

std::size_t FrameStamper::gather(std::array<LockFrame, kMaxLockFrames>& frames) const {
  std::size_t n = 0;
  for (std::uint64_t i = waiting_.begin_index(); i < waiting_.end_index() && n < static_cast<std::size_t>(config_.lock_frames); ++i) {
    const Entry& w = waiting_[i];
    if (w.number != 0) frames[n++] = {w.number, w.info.camera_tick_ns, w.info.t_arrival, w.info.exposure};
  }
  return n;
}

bool FrameStamper::acquire() {
  std::array<LockFrame, kMaxLockFrames> all;
  const std::size_t n = waiting_.front().number == 0 ? 0 : gather(all);
  const std::span<const LockFrame> frames(all.data(), n);
  if (n < static_cast<std::size_t>(config_.lock_frames)) {
    if (waiting_.front().number != 0 && may_wait()) return false;
    give_up_front();
    return true;
  }
  const Duration period = quiet_period(frames, kQuiet, config_.residual_max);
  const bool edges_seen = !edges_.empty() && edges_.back().t > frames.back().arrival;
  if (period.ns > 0 && !edges_seen && may_wait()) return false;
  LockCandidates found;
  if (period.ns > 0 && edges_seen) find_locks(frames, edges_, period, gates(), found);
  if (const LockCandidate* chosen = choose(found, frames, period)) lock(*chosen, frames, period);
  else give_up_front();
  return true;
}

// One candidate, and the gap before the first edge does not speak against it; or the gap picks one of several. Arrivals that
// are late by a period would shift the number towards more edges than frames since the start: that is never believed.
const LockCandidate* FrameStamper::choose(const LockCandidates& found, std::span<const LockFrame> frames, Duration period) {
  if (found.empty() || start_refused_) return nullptr;
  const LockFrame& first = frames.front();
  const std::uint64_t first_id = config_.first_frame_id != 0 ? config_.first_frame_id : first_number_;
  const std::int64_t steps = static_cast<std::int64_t>(first.number - first_id);
  const bool gap = start_known_ && first_edge_ && *first_edge_ <= frames.back().arrival && std::llabs(steps) <= kStartReaches;
  const auto after_first_edge = [&](const LockCandidate& c) {
    return Duration{first.tick_ns + c.edge_minus_tick.ns - steps * period.ns - first_edge_->ns};
  };
  const bool arrivals_tell = config_.transport_max + config_.arrival_slack < period;
  if (found.size() > 1 || !arrivals_tell) {
    for (const LockCandidate& c : found)
      if (gap && std::llabs(after_first_edge(c).ns) < period.ns / 4) return &c;
    ++counters_.ambiguous;
    return nullptr;
  }
  if (doubt_ && std::llabs((found[0].edge_minus_tick - *doubt_).ns) >= period.ns / 4) { ++counters_.doubtful; return nullptr; }
  if (gap && config_.first_frame_id != 0) {
    if (after_first_edge(found[0]).ns > period.ns / 4) { start_refused_ = true; ++counters_.start_refused; return nullptr; }
    if (after_first_edge(found[0]).ns < -period.ns / 4) ++counters_.first_edges_lost;
  }
  return &found[0];
}

void FrameStamper::lock(const LockCandidate& chosen, std::span<const LockFrame> frames, Duration period) {
  line_.clear_pairs();
  locked_ = true;
  start_known_ = false;
  doubt_.reset();
  beside_in_a_row_ = 0;
  period_ns_ = static_cast<double>(period.ns);
  last_frame_ = {frames.front().number - 1, frames.front().tick_ns - period.ns, {}};
  ++counters_.lock_count;
  for (std::size_t j = 0; j < frames.size(); ++j)
    line_.add(frames[j].tick_ns, edges_[chosen.edge[j]].t);
  for (std::size_t j = 0; j < frames.size();) {
    const Entry f = waiting_.front();
    if (f.number == 0) { give_up_front(); continue; }
    waiting_.pop_front();
    last_pair_ = {f.number, f.info.camera_tick_ns, edges_[chosen.edge[j++]].t};
    emit_edge(f, last_pair_.edge);
  }
  next_edge_ = std::max(next_edge_, chosen.edge[frames.size() - 1] + 1);
}

void FrameStamper::unlock(LockLoss cause) {
  locked_ = false;
  ++counters_.lock_loss[static_cast<std::size_t>(cause)];
  if (cause == LockLoss::kLateArrival) doubt_ = Duration{line_.at(last_frame_.tick_ns).ns - last_frame_.tick_ns};
  line_.clear_pairs();
  if (cause == LockLoss::kNumberBack) line_.clear();
}

// --- results -----------------------------------------------------------------------------------------------------

void FrameStamper::confirm(const Entry& f, Time edge) {
  const double steps = static_cast<double>(f.number - last_frame_.number);
  const double period = static_cast<double>(f.info.camera_tick_ns - last_frame_.tick_ns) / steps;
  if (steps <= 4) period_ns_ += (period - period_ns_) / 16;
  last_pair_ = {f.number, f.info.camera_tick_ns, edge};
  line_.add(f.info.camera_tick_ns, edge);
  beside_in_a_row_ = 0;
}

// Scatter that was seen, and the constant that cannot be seen.
Duration FrameStamper::with_scatter(Duration sigma) const {
  return {std::llround(std::hypot(static_cast<double>(config_.delay_sigma.ns), line_.rms_ns(), static_cast<double>(sigma.ns)))};
}

Time FrameStamper::mid(const Entry& f, Time edge) const { return edge - config_.edge_delay + f.info.exposure / 2; }

void FrameStamper::emit_edge(const Entry& f, Time edge) {
  ++counters_.matched;
  last_frame_ = {f.number, f.info.camera_tick_ns, edge};
  note_arrival(f, edge);
  emit(f, mid(f, edge), with_scatter({}), TimeSource::kStrobe);
}

void FrameStamper::emit_tick(const Entry& f, Duration least_sigma) {
  const Time edge = line_.at(f.info.camera_tick_ns);
  last_frame_ = {f.number, f.info.camera_tick_ns, edge};
  note_arrival(f, edge);
  emit(f, mid(f, edge), std::max(with_scatter(line_.sigma_at(f.info.camera_tick_ns)), least_sigma), TimeSource::kCameraTick);
}

void FrameStamper::give_up_front() {
  const Entry f = waiting_.front();
  waiting_.pop_front();
  if (f.number != 0 && f.number <= last_frame_.number) {   // numbers started afresh while there was no lock
    doubt_.reset();
    start_refused_ = start_known_ = false;
  }
  if (f.number != 0) last_frame_.number = f.number;
  emit_arrival(f, {});
}

void FrameStamper::emit_arrival(const Entry& f, Duration least_sigma) {
  if (f.info.t_arrival.ns == 0) return emit(f, Time{}, Duration{}, TimeSource::kUnknown);
  const double half = static_cast<double>(config_.transport_max.ns) / 2;
  const Duration transport{std::llround(transport_ns_.value_or(half))};
  const double doubt = doubt_ || start_refused_ ? period_ns_ : transport_ns_ ? 0 : half;
  const Duration sigma = std::max({config_.arrival_sigma, least_sigma, Duration{std::llround(doubt)}});
  const Time t_mid = f.info.t_arrival - transport - f.info.exposure / 2;
  emit(f, std::max(t_mid, last_t_mid_ + Duration{1}), sigma, TimeSource::kArrival);
}

void FrameStamper::emit(Entry f, Time t_mid, Duration sigma, TimeSource source) {
  f.info.t_mid = t_mid;
  f.info.t_mid_sigma = sigma;
  f.info.time_source = source;
  if (source != TimeSource::kUnknown) last_t_mid_ = std::max(last_t_mid_, t_mid);
  ++counters_.by_source[static_cast<std::size_t>(source)];
  ready_.push(f);
}

}  // namespace cyclops
