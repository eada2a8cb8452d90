#pragma once
/// Navigation between its updates: the last one moved on with the relative velocity and rate it came with, the less certain the
/// longer ago it was.
///
///   t(T) = t + v T,  R(T) = exp(w T) R              v and w as in nav/relative.hpp, receiver axes
///   P(T) = P + diag( (1/2 D T^2)^2 , (1/2 A T^2)^2 )  A, D: relative accelerations that the update does not know
///
/// Trust    an older update, moved on, is compared with each that comes when it is kHorizon old: in range and attitude it must, in the mean
/// of the last few, have come within kTrust of the sigma stated, in range also of kUnproven of it (errors that last cancel). While it has
/// not, nothing is carried on: a source whose velocities are wrong or left at zero is found out at its second update. Until then it is
/// carried on for as long as what it does not know of the motion stays below kUnproven of the range: 0.7 s for a tanker at 30 m, 0.1 s
/// for a thing in a hand.
///
/// The motion of every feature in the image follows from it: away from the focus of expansion with v, along the flow of the rotation
/// with w. Pictures hold range and attitude of the tanker only loosely; a pose that follows wrong corners leaves this motion.
/// Time: service clock. Threads: one at a time. Memory: fixed. Source: spec 2.8, C21; the growth is that of nav/motion.hpp.
#include <algorithm>
#include <cmath>

#include "geometry/frames.hpp"
#include "msg/tspi.hpp"
#include "nav/nav_config.hpp"

namespace cyclops {

class NavCarry {
 public:
  static constexpr double kHorizon_s = 0.5;
  static constexpr double kTrust = 1;
  static constexpr double kUnproven = 0.004;

  explicit NavCarry(const NavConfig& config) : config_(config) {}

  /// `nav` is that of the frame at `now`, perhaps invalid. Itself when valid, else the last valid one moved on; null when that is too
  /// long ago or not to be trusted.
  const RelativeState* at(Time now, const RelativeState& nav) {
    given_ = true;
    if (nav.valid) {
      compare(now, nav);
      last_ = carried_ = nav;
      t_ = now;
      return &carried_;
    }
    const double T = (now - t_).seconds();
    if (!last_.valid || !trusted() || unproven(T) || T < 0 || T > config_.carry_s) {
      given_ = false;
      return nullptr;
    }
    carried_ = last_;
    carried_.t = now;
    carried_.T_r_k = moved_on(last_, T);
    carried_.covariance.diagonal().head<3>().array() += square(turn(T));
    carried_.covariance.diagonal().tail<3>().array() += square(shift(T));
    carried_.extrapolated = true;
    return &carried_;
  }

  /// The same update as at() last gave, moved to `then`, a frame before: what its velocity and rate say of the way between. Null when at()
  /// gave null, or when they are not to be trusted.
  const RelativeState* before(Time then) {
    const double T = (then - t_).seconds();
    if (!given_ || !trusted() || unproven(std::fabs(T))) return nullptr;
    before_ = last_;
    before_.t = then;
    before_.T_r_k = moved_on(last_, T);
    return &before_;
  }

  /// Of the update that at() gave.
  [[nodiscard]] Duration age(Time now) const { return now - t_; }

 private:
  static constexpr double kGain = 0.25, kLongest_s = 5;
  static double square(double x) { return x * x; }
  [[nodiscard]] double turn(double T) const { return 0.5 * config_.carry_angular_acceleration_rps2 * T * T; }
  [[nodiscard]] double shift(double T) const { return 0.5 * config_.carry_acceleration_mps2 * T * T; }
  [[nodiscard]] bool trusted() const { return turned_ <= kTrust * kTrust && ranged_ <= kTrust * kTrust; }
  [[nodiscard]] bool unproven(double T) const { return !compared_ && shift(T) > kUnproven * last_.T_r_k.translation().xyz.norm(); }

  static Pose<frame::R, frame::K> moved_on(const RelativeState& s, double T) {
    return {Rotation<frame::R, frame::K>(so3_exp(s.rate_r * T) * s.T_r_k.rotation().quaternion()),
            Point<frame::R>(s.T_r_k.translation().xyz + s.velocity_r * T)};
  }

  void compare(Time now, const RelativeState& nav) {
    const double T = (now - t_mark_).seconds();
    if (mark_.valid && T >= 0 && T < kHorizon_s) return;
    if (mark_.valid && T >= kHorizon_s && T <= kLongest_s && turn(T) > 0 && shift(T) > 0) {
      const auto then = moved_on(mark_, T);
      const Vec3 &was = then.translation().xyz, &is = nav.T_r_k.translation().xyz;
      const double turned = so3_log(nav.T_r_k.rotation().quaternion() * then.rotation().quaternion().conjugate()).squaredNorm() / 3;
      const double gain = compared_ ? kGain : 1;
      turned_ += gain * (turned / square(turn(T)) - turned_);
      ranged_ += gain * (square((is.norm() - was.norm()) / std::min(shift(T), kUnproven * is.norm())) - ranged_);
      compared_ = true;
    }
    mark_ = nav;
    t_mark_ = now;
  }

  NavConfig config_;
  RelativeState last_{};
  RelativeState carried_{};
  RelativeState before_{};
  RelativeState mark_{};                 // waits to be compared
  Time t_{}, t_mark_{};
  bool compared_{false};
  bool given_{false};
  double turned_{0}, ranged_{0};         // squared, over the stated variance; mean of the last few
};

}  // namespace cyclops
