#include "nav/schedule.hpp"

namespace cyclops {

bool NavSchedule::due(const FrameInfo& frame) {
  if (frame.time_source == TimeSource::kUnknown) return false;
  if (!started_) { started_ = true; t_first_ = frame.t_mid; }
  const Duration since_first = frame.t_mid - t_first_;
  const bool turn = config_.update_interval_s > 0
                        ? group_is_new(since_first.ns / Duration::from_seconds(config_.update_interval_s).ns)
                        : due_by_number(frame.camera_frame_id);
  return turn && !withheld(since_first);
}

bool NavSchedule::group_is_new(std::int64_t group) {
  if (group <= last_group_) return false;
  last_group_ = group;
  return true;
}

bool NavSchedule::due_by_number(std::uint64_t id) {
  if (config_.update_every_n_frames == 1) return true;
  if (id == 0) return false;
  if (!numbered_ || id < last_id_) {
    numbered_ = true;
    first_id_ = id;
    last_group_ = -1;
  }
  last_id_ = id;
  return group_is_new(static_cast<std::int64_t>((id - first_id_) / static_cast<std::uint64_t>(config_.update_every_n_frames)));
}

bool NavSchedule::withheld(Duration since_first) const {
  for (const DropoutWindow& w : config_.dropouts)
    if (since_first >= Duration::from_seconds(w.start_s) && since_first < Duration::from_seconds(w.end_s)) return true;
  return false;
}

}  // namespace cyclops
