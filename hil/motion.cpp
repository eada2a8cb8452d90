#include "hil/motion.hpp"

#include <cmath>
#include <numbers>

#include "hil/noise.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180, kFoot_m = 0.3048, kInch_m = 0.0254;
constexpr double kStep_s = 1e-3;  // for rates of change
constexpr double kSmallest_m = 1e-3, kSmallest_rad = 1e-5, kSmallest_mps = 1e-3;  // sigmas of a perfect system

}  // namespace

Motion::Motion(const Scenario& scenario, std::uint64_t seed) : s_(scenario) {
  for (std::size_t c = 0; c < waves_.size(); ++c)
    for (std::size_t k = 0; k < 2; ++k) {
      const double stretch = (k == 0 ? 1.0 : 0.45) * (0.8 + 0.4 * uniform(key(seed, 100 + c, k)));
      waves_[c].rate_rps[k] = 2 * std::numbers::pi / (s_.wander_period_s * stretch);
      waves_[c].phase[k] = 2 * std::numbers::pi * uniform(key(seed, 200 + c, k));
      waves_[c].weight[k] = k == 0 ? 0.75 : 0.25;
    }
}

double Motion::wander(int channel, double t) const {
  const Wave& w = waves_[static_cast<std::size_t>(channel)];
  return w.weight[0] * std::sin(w.rate_rps[0] * t + w.phase[0]) + w.weight[1] * std::sin(w.rate_rps[1] * t + w.phase[1]);
}

AircraftState Motion::place(bool tanker, double t) const {
  // The station moves along a straight line of the local level at the start; 10 s of it drop 10 cm below the curved earth's level.
  const Local start = local_from_geodetic(s_.latitude_deg, s_.longitude_deg, s_.height_m);
  const Mat3 heading = rotation_z(s_.heading_deg * kDeg);
  const Vec3 station = start.ecef + start.R_e_n * heading * Vec3(s_.speed_mps * t, 0, 0);
  const Local here = local_from_ecef(station);
  const Mat3 R_e_h = here.R_e_n * heading;  // level axes along the heading
  const int first = tanker ? 0 : 6;
  const Vec3 shift = s_.wander_position_m * Vec3(wander(first, t), wander(first + 1, t), wander(first + 2, t));
  const double a = s_.wander_attitude_deg * kDeg;
  const Mat3 R_h_b = attitude<frame::K>({0.4 * a * wander(first + 3, t), a * wander(first + 4, t), (tanker ? 0.7 : 1.0) * a * wander(first + 5, t)}).matrix();
  AircraftState out;
  out.R_e_b = R_e_h * R_h_b;
  if (tanker) {
    out.position_e = station + R_e_h * shift;
    return out;
  }
  const Vec3 d = (s_.reference_in - s_.ins_in) * kInch_m;
  const double range = (s_.range_ft - s_.closing_ftps * t) * kFoot_m, el = s_.elevation_deg * kDeg, az = s_.azimuth_deg * kDeg;
  const Vec3 nose = Vec3(-d.x(), d.y(), -d.z()) + range * Vec3(-std::cos(el) * std::cos(az), std::cos(el) * std::sin(az), -std::sin(el));
  out.position_e = station + R_e_h * (nose + shift - R_h_b * (s_.lens_in_receiver_m + s_.nose_from_lens_m));
  return out;
}

AircraftState Motion::moving(bool tanker, double t) const {
  AircraftState now = place(tanker, t);
  const AircraftState before = place(tanker, t - kStep_s), after = place(tanker, t + kStep_s);
  now.velocity_e = (after.position_e - before.position_e) / (2 * kStep_s);
  const Mat3 level_before = local_from_ecef(before.position_e).R_e_n.transpose() * before.R_e_b, level_after = local_from_ecef(after.position_e).R_e_n.transpose() * after.R_e_b;
  now.rate_b_rps = so3_log(Eigen::Quaterniond(Mat3(level_before.transpose() * level_after))) / (2 * kStep_s);
  return now;
}

AircraftState Motion::tanker(double t) const { return moving(true, t); }
AircraftState Motion::receiver(double t) const { return moving(false, t); }

NavigationErrors::NavigationErrors(const Scenario& scenario, std::uint64_t seed, std::size_t samples) : s_(scenario), x_(samples) {
  const double keep = std::exp(-1 / (s_.tspi_rate_hz * s_.tspi_tau_s)), fresh = std::sqrt(1 - keep * keep);
  for (std::size_t i = 0; i < samples; ++i)
    for (std::size_t k = 0; k < 12; ++k) {
      const double n = normal(key(seed, i, k));
      x_[i][k] = k >= 6 || i == 0 ? n : keep * x_[i - 1][k] + fresh * n;
    }
}

AircraftState NavigationErrors::said(const AircraftState& truth, std::size_t sample, double scale) const {
  const auto& x = x_[sample];
  const Mat3 R_e_n = local_from_ecef(truth.position_e).R_e_n;
  const double attitude = s_.attitude_sigma_deg * kDeg, rate = s_.rate_sigma_dps * kDeg;
  AircraftState out = truth;
  out.position_e += scale * s_.position_sigma_m * (R_e_n * Vec3(x[0], x[1], x[2]));
  out.R_e_b = truth.R_e_b * so3_exp(scale * attitude * Vec3(x[3], x[4], x[5])).toRotationMatrix();
  out.velocity_e += s_.velocity_sigma_mps * Vec3(x[6], x[7], x[8]);
  out.rate_b_rps += rate * Vec3(x[9], x[10], x[11]);
  out.position_sigma_m = Vec3::Constant(std::max(s_.position_sigma_m, kSmallest_m));
  out.velocity_sigma_mps = std::max(s_.velocity_sigma_mps, kSmallest_mps);
  out.attitude_sigma_rad = Vec3::Constant(std::max(attitude, kSmallest_rad));
  return out;
}

Pose<frame::R, frame::K> relative(const AircraftState& receiver, const AircraftState& tanker) {
  const Mat3 R_r_e = receiver.R_e_b.transpose();
  return {Rotation<frame::R, frame::K>(Mat3(R_r_e * tanker.R_e_b)), Point<frame::R>(R_r_e * (tanker.position_e - receiver.position_e))};
}

}  // namespace cyclops::hil
