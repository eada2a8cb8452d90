#include "nav/motion.hpp"

#include "geometry/earth.hpp"

namespace cyclops {
namespace {

double square(double x) { return x * x; }
Vec3 square(const Vec3& v) { return v.cwiseAbs2(); }

/// Sets the position covariance from the samples' sigma and a further variance, both along north, east and down.
void set_position_covariance(AircraftState& out, const Vec3& sigma_ned, const Vec3& more_ned) {
  const Geodetic g = geodetic_from_ecef(out.position);
  const Mat3 R = level_axes(g.latitude_deg, g.longitude_deg).matrix();
  out.position_root_e = R * sigma_ned.asDiagonal() * R.transpose();
  out.position_cov_e = R * Vec3(square(sigma_ned) + more_ned).asDiagonal() * R.transpose();
}

}  // namespace

Tspi state_from_report(const TspiReport& report, Time t) {
  const Geodetic place{report.latitude_deg, report.longitude_deg, report.height_m};
  const auto R_e_n = level_axes(place.latitude_deg, place.longitude_deg);
  const Eigen::Quaterniond q_n_b = report.q_n_b.normalized();
  Tspi s;
  s.aircraft = report.aircraft;
  s.seq = report.seq;
  s.t = t;
  s.position = ecef_from_geodetic(place);
  s.q_e_b = (R_e_n.quaternion() * q_n_b).normalized();
  s.velocity_e = R_e_n.rotate(report.velocity_ned_mps);
  // The report's rates are relative to level axes that themselves turn over the curved earth.
  s.rate_b = report.rate_b_rps + q_n_b.conjugate() * transport_rate(place, report.velocity_ned_mps);
  s.position_sigma_ned_m = report.position_sigma_m;
  s.velocity_sigma_ned_mps = report.velocity_sigma_mps;
  s.attitude_sigma_rad = report.attitude_sigma_rad;
  return s;
}

AircraftState interpolate(const Tspi& a, const Tspi& b, Time t, const NavConfig& config) {
  CYCLOPS_ASSERT(a.t < b.t && a.t <= t && t <= b.t);
  const double h = (b.t - a.t).seconds();
  const double s = static_cast<double>((t - a.t).ns) / static_cast<double>((b.t - a.t).ns);
  const double r = 1 - s;
  const double h00 = (1 + 2 * s) * r * r, h01 = s * s * (3 - 2 * s);
  const double h10 = s * r * r * h, h11 = -s * s * r * h;
  AircraftState out;
  // Written from a's position: differences of ECEF coordinates are small, the coordinates are not.
  out.position = Point<frame::E>(a.position.xyz + h01 * (b.position - a.position) + h10 * a.velocity_e + h11 * b.velocity_e);
  const Eigen::Quaterniond step = a.q_e_b.conjugate() * b.q_e_b;
  out.q_e_b = (a.q_e_b * so3_exp(s * so3_log(step))).normalized();
  out.velocity_e = r * a.velocity_e + s * b.velocity_e;
  out.rate_b = r * a.rate_b + s * b.rate_b;
  const double curve = square(0.5 * config.acceleration_sigma_mps2 * square(s * r * h));
  set_position_covariance(out, h00 * a.position_sigma_ned_m + h01 * b.position_sigma_ned_m,
                          h10 * h10 * square(a.velocity_sigma_ned_mps) + h11 * h11 * square(b.velocity_sigma_ned_mps) + Vec3::Constant(curve));
  out.attitude_cov_b = (square(Vec3(r * a.attitude_sigma_rad + s * b.attitude_sigma_rad)) +
                        Vec3::Constant(square(0.5 * config.angular_acceleration_sigma_rps2 * s * r * h * h))).asDiagonal();
  return out;
}

AircraftState predict(const Tspi& a, Time t, const NavConfig& config) {
  const double dt = (t - a.t).seconds();
  const Eigen::Quaterniond turn = so3_exp(dt * a.rate_b);
  AircraftState out;
  out.position = Point<frame::E>(a.position.xyz + dt * a.velocity_e);
  out.q_e_b = (a.q_e_b * turn).normalized();
  out.velocity_e = a.velocity_e;
  out.rate_b = a.rate_b;
  const double curve = square(0.5 * config.acceleration_sigma_mps2 * dt * dt);
  set_position_covariance(out, a.position_sigma_ned_m, dt * dt * square(a.velocity_sigma_ned_mps) + Vec3::Constant(curve));
  const Mat3 R = turn.toRotationMatrix();  // body axes at a from body axes at t
  const Mat3 at_a = square(a.attitude_sigma_rad).asDiagonal();
  const double growth = square(config.rate_sigma_rps * dt) + square(0.5 * config.angular_acceleration_sigma_rps2 * dt * dt);
  out.attitude_cov_b = R.transpose() * at_a * R + growth * Mat3::Identity();
  return out;
}

}  // namespace cyclops
