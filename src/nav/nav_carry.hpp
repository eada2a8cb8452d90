#pragma once
/// Navigation between its updates: the last one moved on with the relative velocity and rate it came with, the less certain the
/// longer ago it was.
///
///   t(T) = t + v T,  R(T) = exp(w T) R              v and w as in nav/relative.hpp, receiver axes
///   P(T) = P + diag( (1/2 D T^2)^2 , (1/2 A T^2)^2 )  A, D: relative accelerations that the update does not know
///
/// The motion of every feature in the image follows from it: away from the focus of expansion with v, along the flow of the rotation
/// with w. Pictures hold range and attitude of the tanker only loosely; a pose that follows wrong corners leaves this motion.
/// Time: service clock. Threads: one at a time. Memory: fixed. Source: spec 2.8, C21; the growth is that of nav/motion.hpp.
#include "geometry/frames.hpp"
#include "msg/tspi.hpp"
#include "nav/nav_config.hpp"

namespace cyclops {

class NavCarry {
 public:
  explicit NavCarry(const NavConfig& config) : config_(config) {}

  /// `nav` is that of the frame at `now`, perhaps invalid. Itself when valid, else the last valid one moved on; null when that is too long ago.
  const RelativeState* at(Time now, const RelativeState& nav) {
    if (nav.valid) {
      last_ = carried_ = nav;
      t_ = now;
      return &carried_;
    }
    const double T = (now - t_).seconds();
    if (!last_.valid || T < 0 || T > config_.carry_s) return nullptr;
    move_on(T);
    carried_.t = now;
    return &carried_;
  }

 private:
  void move_on(double T) {
    carried_ = last_;
    carried_.T_r_k = {Rotation<frame::R, frame::K>(so3_exp(last_.rate_r * T) * last_.T_r_k.rotation().quaternion()),
                      Point<frame::R>(last_.T_r_k.translation().xyz + last_.velocity_r * T)};
    const double turn = 0.5 * config_.carry_angular_acceleration_rps2 * T * T, shift = 0.5 * config_.carry_acceleration_mps2 * T * T;
    carried_.covariance.diagonal().head<3>().array() += turn * turn;
    carried_.covariance.diagonal().tail<3>().array() += shift * shift;
    carried_.extrapolated = true;
  }

  NavConfig config_;
  RelativeState last_{};
  RelativeState carried_{};
  Time t_{};
};

}  // namespace cyclops
