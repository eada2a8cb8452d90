#pragma once
/// Which frames are navigation updates. Counted on the camera's own frame numbers or on time since the first frame, never
/// on frames received: a lost frame shifts nothing.
///
///   by number  frames first .. first+n-1 are one group, and so on; the first frame of a group that comes is the update.
///              A frame whose number is unknown (0) is an update only with n = 1. When numbers go back (camera restart,
///              16-bit wrap) the groups begin anew there.
///   by time    the same with groups of update_interval_s since the first frame's mid-exposure.
///   dropouts   windows of time since the first frame in which navigation is withheld. The group of a withheld update is
///              used up, as in a real outage.
/// Frames must come in order of capture. Threads: one at a time. No heap.
#include "msg/frame.hpp"
#include "nav/nav_config.hpp"

namespace cyclops {

class NavSchedule {
 public:
  explicit NavSchedule(const NavConfig& config) : config_(config) {}
  /// Is this frame a navigation update? Ask once a frame. A frame without time (kUnknown) never is.
  [[nodiscard]] bool due(const FrameInfo& frame);

 private:
  [[nodiscard]] bool group_is_new(std::int64_t group);
  [[nodiscard]] bool due_by_number(std::uint64_t id);
  [[nodiscard]] bool withheld(Duration since_first) const;

  NavConfig config_;
  bool started_{false};
  Time t_first_{};
  bool numbered_{false};
  std::uint64_t first_id_{0};
  std::uint64_t last_id_{0};
  std::int64_t last_group_{-1};
};

}  // namespace cyclops
