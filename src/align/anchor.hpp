#pragma once
/// Inside align: the pose that the features agreed on at the last update of navigation, moved on as navigation says it has moved since.
///
/// Navigation's error is that of the pose at the update, and lasts; its motion is good. Carrying the aligned pose instead of navigation's
/// keeps the first out. Where features did not agree at the update, navigation itself is carried on.
///   T = aligned * (change from navigation then to navigation now),  P = P_aligned + what P of navigation has grown by
/// Time: within nav.carry_s of the update. Threads: one at a time. Memory: fixed.
#include "align/pose.hpp"
#include "msg/chain.hpp"
#include "msg/tspi.hpp"

namespace cyclops::align {

class Anchor {
 public:
  /// An update and what the frame made of it.
  void set(const CameraPose& nav, const Mat6& nav_covariance_r, const Alignment& alignment) {
    held_ = alignment.consensus;
    nav_ = nav;
    nav_covariance_r_ = nav_covariance_r;
    aligned_ = alignment.T_c_k;
    P_ = alignment.covariance;
  }
  /// `prior` is that of `carried`, the same update moved on.
  void hold(const RelativeState& carried, const Mat3& R_c_r, Prior& prior) const {
    if (!held_ || !prior.valid) return;
    Mat6 A = Mat6::Zero();
    A.topLeftCorner<3, 3>() = R_c_r;
    A.bottomRightCorner<3, 3>() = R_c_r;
    prior.T = moved(aligned_, difference(nav_, prior.T));
    prior.P = P_ + A * (carried.covariance - nav_covariance_r_) * A.transpose();
  }
  void reset() { held_ = false; }
  /// Features agreed at the last update.
  [[nodiscard]] bool held() const { return held_; }

 private:
  bool held_{false};
  CameraPose nav_{}, aligned_{};
  Mat6 nav_covariance_r_{Mat6::Zero()};  // receiver axes
  Mat6 P_{Mat6::Identity()};             // as Alignment::covariance
};

}  // namespace cyclops::align
