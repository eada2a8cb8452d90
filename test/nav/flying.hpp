#pragma once
/// Aircraft that fly known paths, and the TSPI they would send.
#include <array>
#include <cmath>

#include "geometry/earth.hpp"
#include "nav/motion.hpp"

namespace cyclops::test {

inline constexpr double kDeg = 3.14159265358979323846 / 180;

inline Time at_ms(double ms) { return Time{} + Duration::from_ms(ms); }

/// Turns about the vertical of its datum at a constant rate, with a constant attitude relative to the turn; straight when
/// the rate is zero. Then the body may roll at a constant body rate instead.
struct Flyer {
  Geodetic datum{35, -118, 6000};
  Vec3 offset_n{0, 0, 0};          ///< at time 0, level axes of the datum
  Vec3 velocity_n{150, 80, -2};    ///< at time 0
  Eigen::Quaterniond q_n_b{1, 0, 0, 0};
  double turn_rps{0};
  Vec3 spin_b{0, 0, 0};            ///< only without a turn

  [[nodiscard]] Tspi at(Aircraft aircraft, std::uint32_t seq, Time t) const {
    const double s = (t - Time{}).seconds();
    const auto R = level_axes(datum.latitude_deg, datum.longitude_deg);
    const Vec3 w(0, 0, turn_rps);
    const Eigen::Quaterniond turn = so3_exp(w * s);
    Vec3 p = offset_n + velocity_n * s;
    if (turn_rps != 0) {
      const Vec3 centre = offset_n + Vec3(-velocity_n.y(), velocity_n.x(), 0) / turn_rps;
      p = centre + turn * (offset_n - centre) + Vec3(0, 0, velocity_n.z() * s);
    }
    Tspi out;
    out.aircraft = aircraft;
    out.seq = seq;
    out.t = t;
    out.position = Point<frame::E>(ecef_from_geodetic(datum).xyz + R.rotate(p));
    out.velocity_e = R.rotate(turn * velocity_n);
    out.q_e_b = R.quaternion() * turn * q_n_b * so3_exp(spin_b * s);
    out.rate_b = turn_rps != 0 ? Vec3(q_n_b.conjugate() * w) : spin_b;
    out.position_sigma_ned_m = {0.2, 0.3, 0.5};
    out.velocity_sigma_ned_mps = {0.02, 0.03, 0.05};
    out.attitude_sigma_rad = {1e-3, 2e-3, 3e-3};
    return out;
  }
};

/// The report that a sender at this pose would give.
template <class B>
TspiReport report_at(Aircraft aircraft, const Pose<frame::E, B>& T_e_b) {
  const Geodetic g = geodetic_from_ecef(T_e_b.translation());
  TspiReport r;
  r.aircraft = aircraft;
  r.latitude_deg = g.latitude_deg;
  r.longitude_deg = g.longitude_deg;
  r.height_m = g.height_m;
  r.q_n_b = (level_axes(g.latitude_deg, g.longitude_deg).inverse() * T_e_b.rotation()).quaternion();
  r.position_sigma_m = {0.1, 0.1, 0.2};
  r.attitude_sigma_rad = {1e-3, 1e-3, 2e-3};
  return r;
}

inline double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) { return so3_log(a.conjugate() * b).norm(); }

/// The relative attitude and place of spec 1.7: (psi, theta, phi) = (2, -1, 3) deg.
inline Pose<frame::R, frame::K> spec_1_7() {
  return {Rotation<frame::R, frame::K>(Mat3(rotation_z(2 * kDeg) * rotation_y(-1 * kDeg) * rotation_x(3 * kDeg))),
          Point<frame::R>(33.324658264, 0.110939934, -5.448886999)};
}

}  // namespace cyclops::test
