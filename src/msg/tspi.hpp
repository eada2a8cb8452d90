#pragma once
/// Time, space and position information of one aircraft, already validated and on the service clock.
#include <cstdint>

#include "base/time.hpp"
#include "geometry/frames.hpp"

namespace cyclops {

enum class Aircraft : std::uint8_t { kReceiver = 0, kTanker = 1 };

struct Tspi {
  Aircraft aircraft{Aircraft::kReceiver};
  std::uint32_t seq{0};
  Time t{};                                       ///< validity of the state, service clock
  Point<frame::E> position{};                     ///< INS reference point, ECEF, m (from geodetic WGS-84)
  Eigen::Quaterniond q_e_b{1, 0, 0, 0};           ///< ECEF from body (FRD)
  Vec3 velocity_e{0, 0, 0};                       ///< m/s, ECEF axes
  Vec3 rate_b{0, 0, 0};                           ///< body rates p q r relative to the earth, rad/s
  Vec3 position_sigma_ned_m{0, 0, 0};             ///< 1 sigma north east down
  Vec3 velocity_sigma_ned_mps{0, 0, 0};           ///< 1 sigma north east down
  Vec3 attitude_sigma_rad{0, 0, 0};               ///< 1 sigma about body x y z
};

/// One TSPI message as it came, checked for form (finite, in range, right aircraft) but still on GPS time.
struct TspiReport {
  Aircraft aircraft{Aircraft::kReceiver};
  std::uint32_t seq{0};
  GpsTime t_gps{};
  double latitude_deg{0};                         ///< geodetic WGS-84
  double longitude_deg{0};
  double height_m{0};                             ///< above the ellipsoid
  Vec3 velocity_ned_mps{0, 0, 0};
  Eigen::Quaterniond q_n_b{1, 0, 0, 0};           ///< NED at the aircraft's own position from body (FRD)
  Vec3 rate_b_rps{0, 0, 0};
  Vec3 position_sigma_m{0, 0, 0};                 ///< north east down
  Vec3 velocity_sigma_mps{0, 0, 0};
  Vec3 attitude_sigma_rad{0, 0, 0};
  bool degraded{false};
};

/// Tanker body in receiver body at one time, with the covariance of its error.
struct RelativeState {
  Time t{};
  bool valid{false};
  bool extrapolated{false};                       ///< at least one aircraft: beyond its newest TSPI, or in a gap of it
  Duration age_receiver{};                        ///< t minus the newest TSPI used; <= 0 when interpolated
  Duration age_tanker{};
  Pose<frame::R, frame::K> T_r_k{};
  /// Error of T_r_k: order [rotation vector in r axes, rad (3); translation in r, m (3)];
  /// true R = exp(rotation error) R, true t = t + translation error.
  Mat6 covariance{Mat6::Zero()};
  Vec3 velocity_r{0, 0, 0};                       ///< d/dt of the translation in r axes, m/s
  Vec3 rate_r{0, 0, 0};                           ///< rotation rate of k relative to r, r axes, rad/s
};

/// Why a frame has no RelativeState.
enum class NavAbsence : std::uint8_t {
  kNone,
  kNoReceiver,      ///< no TSPI of it at all
  kNoTanker,
  kNoBoth,
  kTooOldReceiver,  ///< its nearest TSPI is further away than nav.max_age_ms
  kTooOldTanker,
  kNotScheduled,    ///< this frame is not a navigation update
  kNoFrameTime,     ///< the frame has no mid-exposure time
};

}  // namespace cyclops
