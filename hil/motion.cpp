#include "hil/motion.hpp"

#include <cmath>
#include <numbers>

#include "hil/noise.hpp"
#include "hil/way.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180, kInch_m = 0.0254, kGravity = 9.80665, kEarthRate_rps = 7.292115e-5;

/// Gusts on the place of an aircraft: along, right, down.
class Drift {
 public:
  Drift(const Gusts& g, std::uint64_t seed) : along_(g.along_m, key(seed, 1)), right_(g.right_m, key(seed, 2)), down_(g.down_m, key(seed, 3)) {}
  [[nodiscard]] Vec3 at(double t) const { return {along_.at(t), right_.at(t), down_.at(t)}; }

 private:
  Wander along_, right_, down_;
};

/// Euler angles' rates to body rates. Any book; 3-2-1.
Vec3 body_rates(const Vec3& angles, const Vec3& rates) {
  const double pitch = angles[1], bank = angles[2];
  return {rates[2] - rates[0] * std::sin(pitch), rates[1] * std::cos(bank) + rates[0] * std::cos(pitch) * std::sin(bank),
          -rates[1] * std::sin(bank) + rates[0] * std::cos(pitch) * std::cos(bank)};
}

}  // namespace

Motion::Motion(const Scenario& s, std::uint64_t seed) : wind_n_(s.wind_north_mps, s.wind_east_mps, 0), speed_mps_(s.speed_mps) {
  anchor_e_ = local_from_geodetic(s.latitude_deg, s.longitude_deg, s.height_m).ecef;
  const std::vector<Station> stations = tanker_way(s);
  const std::vector<Relative> way = receiver_way(s);
  const Drift tanker_drift(s.tanker_gusts, key(seed, 1)), receiver_drift(s.receiver_gusts, key(seed, 2));
  const Sway tanker_sway(s.wing_rocks, true), receiver_sway(s.wing_rocks, false);
  const Vec3 d = (s.reference_in - s.ins_in) * kInch_m;
  const Vec3 reference = rotation_y(s.tanker_alpha_deg * kDeg) * Vec3(-d.x(), d.y(), -d.z());
  const Vec3 nose = rotation_y(s.receiver_alpha_deg * kDeg) * (s.lens_in_receiver_m + s.nose_from_lens_m);
  std::vector<Vec3> tanker, receiver;
  std::vector<double> roughness;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const double t = control_s(i);
    const Station& at = stations[i];
    const Mat3 banked = at.R_e_h * rotation_x(at.bank_rad);
    const Vec3 from_anchor = at.position_e - anchor_e_;
    tanker.push_back(from_anchor + at.R_e_h * (tanker_drift.at(t) + Vec3(0, tanker_sway.at(t), 0)));
    receiver.push_back(from_anchor + banked * (reference + way[i].nose_m - nose) + at.R_e_h * (receiver_drift.at(t) + Vec3(0, receiver_sway.at(t), 0)));
    roughness.push_back(way[i].gusts);
  }
  tanker_.position = Smooth<3>(kControlStart_s, kControlRate_hz, std::move(tanker));
  receiver_.position = Smooth<3>(kControlStart_s, kControlRate_hz, std::move(receiver));
  tanker_.attitude = attitude_of(tanker_.position, s.tanker_alpha_deg * kDeg, s.tanker_gusts, key(seed, 3), roughness);
  receiver_.attitude = attitude_of(receiver_.position, s.receiver_alpha_deg * kDeg, s.receiver_gusts, key(seed, 4), roughness);
}

Smooth<3> Motion::attitude_of(const Smooth<3>& position, double alpha, const Gusts& gusts, std::uint64_t seed, const std::vector<double>& roughness) const {
  const Wander bank(gusts.bank_deg, key(seed, 1)), pitch(gusts.pitch_deg, key(seed, 2)), yaw(gusts.yaw_deg, key(seed, 3));
  std::vector<Vec3> angles;
  for (std::size_t i = 0; i < roughness.size(); ++i) {
    const double t = control_s(i);
    const auto at = position.at(t);
    const Local level = local_from_ecef(anchor_e_ + at.value);
    const Mat3 R_n_e = level.R_e_n.transpose();
    const Vec3 air = R_n_e * at.first - wind_n_;
    const Vec3 force = R_n_e * (at.second + 2 * kEarthRate_rps * Vec3(-at.first.y(), at.first.x(), 0)) - Vec3(0, 0, kGravity);
    const Vec3 x = air.normalized(), across = force - x * x.dot(force), z = -across.normalized();
    Mat3 R_n_w;
    R_n_w << x, z.cross(x), z;
    const double load = across.norm() / kGravity * (speed_mps_ * speed_mps_) / air.squaredNorm();
    const HeadingPitchBank a = heading_pitch_bank(R_n_w * rotation_y(alpha * load));
    Vec3 now = Vec3(a.heading, a.pitch, a.bank) + roughness[i] * kDeg * Vec3(yaw.at(t), pitch.at(t), bank.at(t));
    if (i > 0) now[0] += 2 * std::numbers::pi * std::round((angles.back()[0] - now[0]) / (2 * std::numbers::pi));
    angles.push_back(now);
  }
  return Smooth<3>(kControlStart_s, kControlRate_hz, std::move(angles));
}

AircraftState Motion::state(const Track& track, double t) const {
  const auto p = track.position.at(t), a = track.attitude.at(t);
  AircraftState out;
  out.position_e = anchor_e_ + p.value;
  out.velocity_e = p.first;
  out.R_e_b = local_from_ecef(out.position_e).R_e_n * rotation_z(a.value[0]) * rotation_y(a.value[1]) * rotation_x(a.value[2]);
  out.rate_b_rps = body_rates(a.value, a.first);
  return out;
}

AirAngles Motion::air_angles(const AircraftState& s) const {
  const Vec3 air = s.R_e_b.transpose() * (s.velocity_e - local_from_ecef(s.position_e).R_e_n * wind_n_);
  return {std::atan2(air.z(), air.x()), std::asin(air.y() / air.norm())};
}

Pose<frame::R, frame::K> relative(const AircraftState& receiver, const AircraftState& tanker) {
  const Mat3 R_r_e = receiver.R_e_b.transpose();
  return {Rotation<frame::R, frame::K>(Mat3(R_r_e * tanker.R_e_b)), Point<frame::R>(R_r_e * (tanker.position_e - receiver.position_e))};
}

}  // namespace cyclops::hil
