#include "nav/frame_aligner.hpp"

#include <algorithm>

namespace cyclops {

FrameAligner::FrameAligner(const NavConfig& config, const NavRig& rig)
    : config_(config), navigator_(config, rig), schedule_(config), slots_(static_cast<std::size_t>(config.max_waiting_frames) + kReadyRoom) {}

Admission FrameAligner::push(const Tspi& sample) {
  const Admission admission = navigator_.push(sample);
  settle();
  return admission;
}

void FrameAligner::push(const FrameInfo& frame, std::uint64_t token) {
  if (waiting() == static_cast<std::size_t>(config_.max_waiting_frames)) release(&AlignerCounters::squeezed_out);
  CYCLOPS_ASSERT(size_ < slots_.size());
  AlignedFrame& s = slot(size_++);
  s = AlignedFrame{frame, token, schedule_.due(frame), {}};
  ++counters_.frames;
  if (frame.time_source != TimeSource::kUnknown) {
    t_latest_ = any_time_ ? std::max(t_latest_, frame.t_mid) : frame.t_mid;
    any_time_ = true;
  }
  settle();
  counters_.most_waiting = std::max<std::uint64_t>(counters_.most_waiting, waiting());
}

void FrameAligner::settle() {
  while (waiting() != 0) {
    const AlignedFrame& oldest = slot(ready_);
    if (!oldest.scheduled) release(&AlignerCounters::not_needed);
    else if (navigator_.covers(oldest.frame.t_mid)) release(&AlignerCounters::covered);
    else if (t_latest_ - oldest.frame.t_mid >= Duration::from_ms(config_.max_wait_ms)) release(&AlignerCounters::timed_out);
    else return;
  }
}

void FrameAligner::release(std::uint64_t AlignerCounters::*why) {
  AlignedFrame& s = slot(ready_++);
  ++(counters_.*why);
  if (s.scheduled) {
    s.nav = navigator_.at(s.frame.t_mid, s.frame.t_mid_sigma);
    if (!s.nav.state.valid) ++counters_.without_nav;
    return;
  }
  s.nav = NavAnswer{};
  s.nav.state.t = s.frame.t_mid;
  s.nav.absence = s.frame.time_source == TimeSource::kUnknown ? NavAbsence::kNoFrameTime : NavAbsence::kNotScheduled;
}

void FrameAligner::flush() {
  while (waiting() != 0) release(&AlignerCounters::flushed);
}

bool FrameAligner::pop(AlignedFrame& out) {
  if (ready_ == 0) return false;
  out = slot(0);
  head_ = (head_ + 1) % slots_.size();
  --size_;
  --ready_;
  return true;
}

}  // namespace cyclops
