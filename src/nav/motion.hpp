#pragma once
/// One aircraft between and beyond its TSPI samples, with the covariance of what comes out.
///
/// Between a and b (h apart, s = share of the way, T0 and T1 the distances in time to a and b)
///   position   cubic Hermite in ECEF: exact for motion up to a constant jerk; in a turn of rate w at speed v the error is
///              below v w^3 h^4 / 384 (200 m/s, 3 deg/s, 50 ms: 5e-10 m)
///   attitude   geodesic, q_a exp(s log(q_a^-1 q_b)): exact for a constant body rate. Reported rates are not used here: a
///              source that leaves them at zero would bend the path, and acceleration costs only 1/8 h^2 |dw/dt|
///   velocity and rate   linear
/// Beyond a sample, T away: constant velocity (ECEF) and constant body rate.
/// Covariance
///   beyond     position  sp^2 + (sv T)^2 + (1/2 A T^2)^2        attitude  sa^2 + (R T)^2 + (1/2 D T^2)^2
///   between    position  (H00 spa + H01 spb)^2 + h^2 (H10^2 sva^2 + H11^2 svb^2) + (1/2 A (T0 T1 / h)^2)^2
///              attitude  ((1-s) saa + s sab)^2 + (1/2 D T0 T1)^2
///   with sp, sv, sa the sample's own sigmas, A acceleration, R rate, D angular acceleration of NavConfig. The errors of
///   neighbouring samples are taken as fully correlated, because those of an INS are: averaging would promise too much.
/// Threads  pure. Memory: no heap. Time base: service clock.
#include "msg/tspi.hpp"
#include "nav/nav_config.hpp"

namespace cyclops {

/// From a report to a sample at `t`, the report's time on the service clock.
[[nodiscard]] Tspi state_from_report(const TspiReport& report, Time t);

/// One aircraft at one time.
struct AircraftState {
  Point<frame::E> position{};               ///< TSPI reference point
  Eigen::Quaterniond q_e_b{1, 0, 0, 0};     ///< ECEF from body
  Vec3 velocity_e{0, 0, 0};                 ///< m/s, ECEF axes
  Vec3 rate_b{0, 0, 0};                     ///< relative to the earth, body axes, rad/s
  Mat3 position_cov_e{Mat3::Zero()};        ///< m^2, ECEF axes
  Mat3 position_root_e{Mat3::Zero()};       ///< m, symmetric root of the part of it that is the samples' own position error
  Mat3 attitude_cov_b{Mat3::Zero()};        ///< rad^2, small rotation about body axes: true q = q exp(error)
};

/// Needs a.t < b.t and a.t <= t <= b.t.
[[nodiscard]] AircraftState interpolate(const Tspi& a, const Tspi& b, Time t, const NavConfig& config);
/// Forward or backward in time from one sample.
[[nodiscard]] AircraftState predict(const Tspi& a, Time t, const NavConfig& config);

}  // namespace cyclops
