#pragma once
/// Inside align: small changes of a camera-from-tanker pose, and what they do to a pixel.
///
/// A change d is [rotation vector about the tanker INS in c axes (rad); translation in c (m)], as in Alignment::covariance.
#include <optional>

#include "align/reading.hpp"
#include "geometry/camera.hpp"

namespace cyclops::align {

using CameraPose = Pose<frame::C, frame::K>;

/// A pose and its covariance before this frame's image is looked at.
struct Prior {
  CameraPose T{};
  Mat6 P{Mat6::Identity()};
  bool valid{false};
};

inline CameraPose moved(const CameraPose& T, const Vec6& d) {
  const Rotation<frame::C, frame::K> R(so3_exp(d.head<3>()) * T.rotation().quaternion());
  return {R, Point<frame::C>(T.translation().xyz + d.tail<3>())};
}

/// d with moved(a, d) = b.
inline Vec6 difference(const CameraPose& a, const CameraPose& b) {
  Vec6 d;
  d.head<3>() = so3_log(b.rotation().quaternion() * a.rotation().quaternion().conjugate());
  d.tail<3>() = b.translation() - a.translation();
  return d;
}

/// Squared Mahalanobis length, 6 degrees of freedom. P: covariance of d.
inline double squared_length(const Vec6& d, const Mat6& P) { return d.dot(P.ldlt().solve(d)); }

/// That of the difference of two poses. P: its covariance.
inline double squared_distance(const CameraPose& a, const CameraPose& b, const Mat6& P) { return squared_length(difference(a, b), P); }

struct Projected {
  Vec2 uv{0, 0};                                     ///< raw px
  Jac by_pose{Jac::Zero()};                          ///< d uv / d d
  Eigen::Matrix<double, 2, 3> by_point{Eigen::Matrix<double, 2, 3>::Zero()};  ///< d uv / d p_c, px/m
};

/// Nothing when the point is not before the camera or the lens model folds back there.
inline std::optional<Projected> projected(const Camera& camera, const CameraPose& pose, const Point<frame::K>& p) {
  Projected out;
  const auto uv = camera.project(pose * p, out.by_point);
  if (!uv) return std::nullopt;
  out.uv = *uv;
  out.by_pose << -out.by_point * skew(pose.rotation().rotate(p.xyz)), out.by_point;
  return out;
}

}  // namespace cyclops::align
