#pragma once
/// Rotations, poses and points that know their frames. The table of letters is src/geometry/frames.md.
///
/// `Pose<R, K> T_r_k` takes a point in tanker body to receiver body: p_r = T_r_k * p_k.
/// What must not be done is missing: attitudes have no subtraction, a flight-path direction is not an attitude.
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace cyclops {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat2 = Eigen::Matrix2d;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;

namespace frame {
struct E {};  ///< ECEF
struct N {};  ///< north-east-down at the datum
struct M {};  ///< tanker model
struct K {};  ///< tanker body
struct R {};  ///< receiver body
struct C {};  ///< camera
}  // namespace frame

/// A point, metres.
template <class F>
struct Point {
  Vec3 xyz{0, 0, 0};
  Point() = default;
  explicit Point(const Vec3& v) : xyz(v) {}
  Point(double x, double y, double z) : xyz(x, y, z) {}
  friend Vec3 operator-(const Point& a, const Point& b) { return a.xyz - b.xyz; }
};

/// Components of frame From become components of frame To.
template <class To, class From>
class Rotation {
 public:
  Rotation() = default;
  explicit Rotation(const Eigen::Quaterniond& q) : q_(q.normalized()) {}
  explicit Rotation(const Mat3& m) : q_(Eigen::Quaterniond(m).normalized()) {}
  [[nodiscard]] const Eigen::Quaterniond& quaternion() const { return q_; }
  [[nodiscard]] Mat3 matrix() const { return q_.toRotationMatrix(); }
  [[nodiscard]] Rotation<From, To> inverse() const { return Rotation<From, To>(q_.conjugate()); }
  template <class B>
  [[nodiscard]] Rotation<To, B> operator*(const Rotation<From, B>& o) const { return Rotation<To, B>(q_ * o.quaternion()); }
  [[nodiscard]] Point<To> operator*(const Point<From>& p) const { return Point<To>(q_ * p.xyz); }
  [[nodiscard]] Vec3 rotate(const Vec3& v_from) const { return q_ * v_from; }

 private:
  Eigen::Quaterniond q_{Eigen::Quaterniond::Identity()};
};

template <class To, class From>
class Pose {
 public:
  Pose() = default;
  Pose(const Rotation<To, From>& rotation, const Point<To>& origin_of_from) : R_(rotation), t_(origin_of_from) {}
  [[nodiscard]] const Rotation<To, From>& rotation() const { return R_; }
  [[nodiscard]] const Point<To>& translation() const { return t_; }
  [[nodiscard]] Pose<From, To> inverse() const {
    const auto Ri = R_.inverse();
    return {Ri, Point<From>(-(Ri.rotate(t_.xyz)))};
  }
  template <class B>
  [[nodiscard]] Pose<To, B> operator*(const Pose<From, B>& o) const {
    return {R_ * o.rotation(), Point<To>(R_.rotate(o.translation().xyz) + t_.xyz)};
  }
  [[nodiscard]] Point<To> operator*(const Point<From>& p) const { return Point<To>(R_.rotate(p.xyz) + t_.xyz); }

 private:
  Rotation<To, From> R_{};
  Point<To> t_{};
};

/// Heading, pitch and bank of a body, rad, aerospace 3-2-1. For people and files; never for arithmetic.
struct HeadingPitchBank {
  double heading{0};
  double pitch{0};
  double bank{0};
};

/// Direction of flight, rad: track over ground from north, climb angle. It says nothing about attitude.
struct FlightPath {
  double track{0};
  double climb{0};
};

[[nodiscard]] Mat3 rotation_x(double rad);
[[nodiscard]] Mat3 rotation_y(double rad);
[[nodiscard]] Mat3 rotation_z(double rad);

/// R_n_b = Rz(heading) Ry(pitch) Rx(bank). Spec 1.2 step 2.
template <class Body>
[[nodiscard]] Rotation<frame::N, Body> attitude(const HeadingPitchBank& a) {
  return Rotation<frame::N, Body>(Mat3(rotation_z(a.heading) * rotation_y(a.pitch) * rotation_x(a.bank)));
}
[[nodiscard]] HeadingPitchBank heading_pitch_bank(const Mat3& R_n_b);

/// The general correction of a flight-path-referenced relative vector into receiver body axes. Spec 3.5.
[[nodiscard]] Point<frame::R> receiver_body_from_path(const Vec3& p_path, const FlightPath& path,
                                                      const Rotation<frame::N, frame::R>& R_n_r);

/// Camera mount: pan + right, tilt + up, roll + right side down, rad; 0 0 0 looks along the receiver's nose.
struct MountAngles {
  double pan{0};
  double tilt{0};
  double roll{0};
};
/// R_c_r = (Rz(pan) Ry(tilt) Rx(roll) A^T)^T with A: RDF components from FRD components. Spec 1.2 step 3.
[[nodiscard]] Rotation<frame::C, frame::R> camera_from_receiver(const MountAngles& mount);

/// Exponential and logarithm of SO(3); rotation vector in rad.
[[nodiscard]] Eigen::Quaterniond so3_exp(const Vec3& rotation_vector);
[[nodiscard]] Vec3 so3_log(const Eigen::Quaterniond& q);
[[nodiscard]] Mat3 skew(const Vec3& v);

}  // namespace cyclops
