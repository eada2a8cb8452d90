// What comes into the stamper, and out of it.
#include <algorithm>
#include <cstdlib>

#include "timesync/frame_stamper.hpp"

namespace cyclops {
namespace {

constexpr std::int64_t kIdCycle = 65535;   // 16-bit block ids: 1..65535, never 0

}  // namespace

void FrameStamper::restart(Time start) {
  flush();
  if (locked_) unlock(LockLoss::kRestart);
  line_.clear();
  not_before_ = start;
  start_known_ = true;
  start_refused_ = starved_ = false;
  doubt_.reset();
  first_number_ = last_number_ = last_id_ = last_frame_.number = 0;
  while (!edges_.empty() && edges_.front().t < start) edges_.pop_front();
  next_edge_ = edges_.begin_index();
  first_edge_.reset();
  for (std::uint64_t i = edges_.begin_index(); i + 1 < edges_.end_index(); ++i) note_start(edges_[i].t, edges_[i + 1].t);
  if (edges_.empty()) last_edge_.reset();
}

void FrameStamper::on_edge(const StrobeEdge& edge) {
  ++counters_.edges;
  if (edge.rising != config_.rising) { ++counters_.edges_other; return; }
  if (edge.t < not_before_) { ++counters_.edges_before_start; return; }
  if (last_edge_ && edge.t <= last_edge_->t) { ++counters_.edges_disordered; return; }
  if (last_edge_) {
    count_interval(*last_edge_, edge);
    note_start(last_edge_->t, edge.t);
  }
  last_edge_ = edge;
  edges_.push(edge);
  next_edge_ = std::max(next_edge_, edges_.begin_index());
  starved_ = false;
  run();
}

bool FrameStamper::on_frame(const FrameInfo& frame, FrameToken token) {
  if (waiting_.size() + ready_.size() >= kReady) { ++counters_.refused_frames; return false; }
  ++counters_.frames;
  const std::uint64_t number = number_of(frame);
  if (number == 0) ++counters_.unnumbered;
  else if (first_number_ == 0) first_number_ = number;
  waiting_.push({frame, token, number});
  run();
  return true;
}

void FrameStamper::flush() {
  flushing_ = true;
  run();
  flushing_ = false;
}

bool FrameStamper::pop(FrameInfo& frame, FrameToken& token) {
  if (ready_.empty()) return false;
  frame = ready_.front().info;
  token = ready_.front().token;
  ready_.pop_front();
  return true;
}

// The camera's number without wrap; 0 when the frame has none that can be believed. An incomplete frame whose number is not
// later than the last one carries what was left in its buffer.
std::uint64_t FrameStamper::number_of(const FrameInfo& frame) {
  if (frame.camera_frame_id == 0 || frame.camera_tick_ns <= 0) return 0;
  std::uint64_t number = frame.camera_frame_id;
  if (config_.id_bits == 16 && last_id_ != 0) {
    std::int64_t step = static_cast<std::int64_t>(frame.camera_frame_id) - static_cast<std::int64_t>(last_id_);
    if (step < -kIdCycle / 2) step += kIdCycle;
    if (step > 0 || frame.status != FrameStatus::kComplete) number = last_number_ + static_cast<std::uint64_t>(step);
  }
  const bool back = last_number_ != 0 && static_cast<std::int64_t>(number - last_number_) <= 0;
  if (back && frame.status != FrameStatus::kComplete) return 0;
  last_id_ = frame.camera_frame_id;
  last_number_ = number;
  return number;
}

void FrameStamper::count_interval(const StrobeEdge& before, const StrobeEdge& edge) {
  const Duration interval = edge.t - before.t;
  const std::int64_t period = config_.period.ns;
  if (interval.ns < period / 8) ++counters_.edges_doubled;
  if (before.line_seq >= 0 && edge.line_seq >= 0) {
    if (edge.line_seq > before.line_seq) counters_.edges_lost_seq += static_cast<std::uint64_t>(edge.line_seq - before.line_seq - 1);
    return;
  }
  const std::int64_t steps = (interval.ns + period / 2) / period;
  if (steps >= 2 && std::llabs(interval.ns - steps * period) < period / 8) counters_.edges_lost_inferred += static_cast<std::uint64_t>(steps - 1);
}

// A glitch when the camera is switched on stands alone; the first exposure is followed by another after one period.
void FrameStamper::note_start(Time before, Time edge) {
  if (start_known_ && !first_edge_ && std::llabs((edge - before).ns - config_.period.ns) < config_.period.ns / 8) first_edge_ = before;
}

}  // namespace cyclops
