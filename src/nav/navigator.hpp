#pragma once
/// TSPI of both aircraft in, the tanker relative to the receiver at any time out. With nav/frame_aligner.hpp, which
/// merges frames and TSPI by sensor time, this is the stage.
///
/// Frames   RelativeState is the tanker's INS in receiver body axes; conventions in msg/tspi.hpp, formulas in nav/relative.hpp.
/// Time     service clock; the caller turns GPS time into it (timesync) before state_from_report.
/// Errors   none: what cannot be answered is a RelativeState with valid = false and a NavAbsence.
/// Threads  one at a time. Memory: allocated on construction only.
#include "nav/nav_config.hpp"
#include "nav/relative.hpp"
#include "nav/tspi_buffer.hpp"

namespace cyclops {

struct NavAnswer {
  RelativeState state{};                     ///< t is always set; the rest only when state.valid
  NavAbsence absence{NavAbsence::kNoBoth};   ///< kNone when state.valid
};

class Navigator {
 public:
  Navigator(const NavConfig& config, const NavRig& rig);

  Admission push(const Tspi& sample);  ///< of either aircraft
  [[nodiscard]] bool covers(Time t) const { return receiver_.covers(t) && tanker_.covers(t); }
  /// `t_sigma`: 1 sigma of t, common to both aircraft; what the relative state does in that time joins the covariance.
  [[nodiscard]] NavAnswer at(Time t, Duration t_sigma = {}) const;

  [[nodiscard]] const TspiBuffer& buffer(Aircraft aircraft) const { return aircraft == Aircraft::kReceiver ? receiver_ : tanker_; }

 private:
  NavConfig config_;
  NavRig rig_;
  TspiBuffer receiver_;
  TspiBuffer tanker_;
};

}  // namespace cyclops
