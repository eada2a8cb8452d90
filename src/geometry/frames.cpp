#include "geometry/frames.hpp"

#include <cmath>

namespace cyclops {

Mat3 rotation_x(double a) {
  Mat3 m;
  m << 1, 0, 0, 0, std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a);
  return m;
}

Mat3 rotation_y(double a) {
  Mat3 m;
  m << std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a);
  return m;
}

Mat3 rotation_z(double a) {
  Mat3 m;
  m << std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a), 0, 0, 0, 1;
  return m;
}

HeadingPitchBank heading_pitch_bank(const Mat3& R) {
  return {std::atan2(R(1, 0), R(0, 0)), -std::asin(std::fmax(-1.0, std::fmin(1.0, R(2, 0)))), std::atan2(R(2, 1), R(2, 2))};
}

Point<frame::R> receiver_body_from_path(const Vec3& p_path, const FlightPath& path,
                                        const Rotation<frame::N, frame::R>& R_n_r) {
  const Vec3 p_n = rotation_z(path.track) * rotation_y(path.climb) * p_path;
  return Point<frame::R>(R_n_r.inverse().rotate(p_n));
}

Rotation<frame::C, frame::R> camera_from_receiver(const MountAngles& mount) {
  Mat3 A;
  A << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  const Mat3 R_r_c = rotation_z(mount.pan) * rotation_y(mount.tilt) * rotation_x(mount.roll) * A.transpose();
  return Rotation<frame::C, frame::R>(Mat3(R_r_c.transpose()));
}

Eigen::Quaterniond so3_exp(const Vec3& w) {
  const double angle = w.norm();
  const double half = 0.5 * angle;
  const double k = angle < 1e-8 ? 0.5 - angle * angle / 48.0 : std::sin(half) / angle;
  return {std::cos(half), k * w.x(), k * w.y(), k * w.z()};
}

Vec3 so3_log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const Vec3 v = sign * q.vec();
  const double s = v.norm();
  if (s < 1e-12) return 2.0 * v;
  return (2.0 * std::atan2(s, sign * q.w()) / s) * v;
}

Mat3 skew(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace cyclops
