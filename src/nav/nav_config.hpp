#pragma once
/// What an algorithm engineer changes about navigation (profile, table `nav`), and where each aircraft's TSPI refers to
/// (rig, table `tspi`).
#include "base/config.hpp"
#include "base/result.hpp"
#include "base/static_vector.hpp"
#include "geometry/frames.hpp"

namespace cyclops {

/// Part of a run in which navigation is withheld: start <= time since the first frame < end.
struct DropoutWindow {
  double start_s{0};
  double end_s{0};
  bool operator==(const DropoutWindow&) const = default;
};
inline constexpr std::size_t kMaxDropouts = 32;

struct NavConfig {
  double max_wait_ms{100};     ///< a frame waits for TSPI until one this much later has come in
  double max_age_ms{500};      ///< furthest prediction from the nearest sample
  double max_gap_ms{250};      ///< widest gap that is interpolated
  double max_jump_s{5};        ///< a sample further than this from the newest needs two more that agree with it
  // What the samples cannot tell; each is 1 sigma. The covariance grows by them, see nav/motion.hpp.
  double acceleration_sigma_mps2{1.0};
  double rate_sigma_rps{0.01};                  ///< error of the reported body rates, per axis
  double angular_acceleration_sigma_rps2{0.2};
  double position_correlation{0};               ///< 0..1, of the two aircraft's position errors (same receivers, same sky)
  // Which frames are navigation updates, see nav/schedule.hpp.
  int update_every_n_frames{1};
  double update_interval_s{0};                  ///< above 0: by time instead of by frame number
  StaticVector<DropoutWindow, kMaxDropouts> dropouts{};  ///< file: dropouts_s = [start, end, start, end ...]
  // The last update carried on to frames without one, see nav/nav_carry.hpp.
  double carry_s{1.5};                          ///< for so long; 0: an update counts at its own frame only
  double carry_acceleration_mps2{0.3};          ///< relative acceleration that it does not know, 1 sigma an axis
  double carry_angular_acceleration_rps2{0.05}; ///< as that, for the relative attitude
  int max_waiting_frames{32};                   ///< more than this, and the oldest goes on with what there is

  /// Reads the keys of the table `nav` itself. Error: file:line: key, value and its range. Types and unknown keys: finish().
  static Result<NavConfig> read(ConfigTable& nav, NavConfig absent);  ///< `absent`: values of keys left out
  /// The same checks for a config made in code; `where` is "nav.<key>".
  [[nodiscard]] Result<> validated() const;
  bool operator==(const NavConfig&) const = default;
};

/// From the point a TSPI report speaks about to the INS reference point, body axes (forward right down), m.
struct NavRig {
  Vec3 receiver_ins_from_tspi_m{0, 0, 0};
  Vec3 tanker_ins_from_tspi_m{0, 0, 0};
  /// Keys receiver_ins_m and tanker_ins_m of the rig's table `tspi`, each three numbers below 100 m.
  static Result<NavRig> read(ConfigTable& tspi);
};

}  // namespace cyclops
