#include "geometry/camera.hpp"

#include <cmath>

namespace cyclops {
namespace {

/// d lens / d xy of the Brown-Conrady model.
Mat2 lens_jacobian(const Intrinsics& k, const Vec2& xy) {
  const double x = xy.x(), y = xy.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
  const double slope = 2 * (k.k1 + r2 * (2 * k.k2 + r2 * 3 * k.k3));  // d radial / d r2 times 2
  Mat2 J;
  J(0, 0) = radial + x * x * slope + 2 * k.p1 * y + 6 * k.p2 * x;
  J(0, 1) = x * y * slope + 2 * k.p1 * x + 2 * k.p2 * y;
  J(1, 0) = x * y * slope + 2 * k.p1 * x + 2 * k.p2 * y;
  J(1, 1) = radial + y * y * slope + 6 * k.p1 * y + 2 * k.p2 * x;
  return J;
}

}  // namespace

Vec2 Camera::lens(const Vec2& xy) const {
  if (!has_lens()) return xy;
  const double x = xy.x(), y = xy.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (k_.k1 + r2 * (k_.k2 + r2 * k_.k3));
  return {x * radial + 2 * k_.p1 * x * y + k_.p2 * (r2 + 2 * x * x),
          y * radial + k_.p1 * (r2 + 2 * y * y) + 2 * k_.p2 * x * y};
}

std::optional<Vec2> Camera::project_ideal(const Point<frame::C>& p) const {
  if (!(p.xyz.z() > 0)) return std::nullopt;
  return Vec2(k_.cx_px + k_.fx_px * p.xyz.x() / p.xyz.z(), k_.cy_px + k_.fy_px * p.xyz.y() / p.xyz.z());
}

std::optional<Vec2> Camera::project(const Point<frame::C>& p) const {
  Eigen::Matrix<double, 2, 3> unused;
  return project(p, unused);
}

std::optional<Vec2> Camera::project(const Point<frame::C>& p, Eigen::Matrix<double, 2, 3>& jacobian) const {
  if (!(p.xyz.z() > 0)) return std::nullopt;
  const double iz = 1.0 / p.xyz.z();
  const Vec2 xy(p.xyz.x() * iz, p.xyz.y() * iz);
  const Mat2 J_lens = has_lens() ? lens_jacobian(k_, xy) : Mat2::Identity();
  if (!(J_lens.determinant() > 0) || !(J_lens.trace() > 0)) return std::nullopt;
  const Vec2 d = lens(xy);
  const Vec2 ideal(k_.cx_px + k_.fx_px * d.x(), k_.cy_px + k_.fy_px * d.y());
  const Mat2 J_wind = Mat2::Identity() + windscreen_.delta_jacobian(ideal);
  Eigen::Matrix<double, 2, 3> J_pin;
  J_pin << iz, 0, -xy.x() * iz, 0, iz, -xy.y() * iz;
  jacobian = J_wind * Eigen::DiagonalMatrix<double, 2>(k_.fx_px, k_.fy_px) * J_lens * J_pin;
  return windscreen_.distort(ideal);
}

Vec2 Camera::raw_from_ideal(const Vec2& ideal) const {
  const Vec2 d = lens({(ideal.x() - k_.cx_px) / k_.fx_px, (ideal.y() - k_.cy_px) / k_.fy_px});
  return windscreen_.distort({k_.cx_px + k_.fx_px * d.x(), k_.cy_px + k_.fy_px * d.y()});
}

Vec2 Camera::ideal_from_raw(const Vec2& raw) const {
  const Vec2 seen = windscreen_.undistort(raw);
  const Vec2 d((seen.x() - k_.cx_px) / k_.fx_px, (seen.y() - k_.cy_px) / k_.fy_px);
  Vec2 xy = d;
  if (has_lens())
    for (int n = 0; n < 20; ++n) {  // Newton on lens(xy) = d
      const Vec2 step = lens_jacobian(k_, xy).partialPivLu().solve(d - lens(xy));
      if (!step.allFinite()) break;
      xy += step;
      if (step.norm() < 1e-12) break;
    }
  return {k_.cx_px + k_.fx_px * xy.x(), k_.cy_px + k_.fy_px * xy.y()};
}

Mat2 Camera::ideal_from_raw_jacobian(const Vec2& raw) const {
  constexpr double h = 0.5;
  Mat2 J;
  J.col(0) = ideal_from_raw(raw + Vec2(h, 0)) - ideal_from_raw(raw - Vec2(h, 0));
  J.col(1) = ideal_from_raw(raw + Vec2(0, h)) - ideal_from_raw(raw - Vec2(0, h));
  return J / (2 * h);
}

Vec2 Camera::z_point_m(const Vec2& ideal) const {
  return {(k_.cx_px - ideal.x()) * k_.pitch_m, (k_.cy_px - ideal.y()) * k_.pitch_m};
}

Vec3 Camera::line_of_sight(const Vec2& ideal) const {
  return Vec3((ideal.x() - k_.cx_px) / k_.fx_px, (ideal.y() - k_.cy_px) / k_.fy_px, 1.0).normalized();
}

bool Camera::inside(const Vec2& raw) const {
  return raw.x() >= -0.5 && raw.y() >= -0.5 && raw.x() < k_.width - 0.5 && raw.y() < k_.height - 0.5;
}

}  // namespace cyclops
