#include "hil/way.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/flight_messages.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180, kFoot_m = 0.3048, kGravity = 9.80665;
constexpr double kAfter_s = 4;  // control values behind the last frame

/// 0 to 1 at rest at both ends, least jerk: 10 x^3 - 15 x^4 + 6 x^5.
double rest_to_rest(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10 + x * (-15 + 6 * x));
}

double bank_at(const std::vector<Turn>& turns, double t) {
  double bank = 0;
  for (const Turn& turn : turns) bank += (turn.bank_deg * kDeg - bank) * rest_to_rest((t - turn.at_s) / turn.over_s);
  return bank;
}

struct Place { double range_ft, azimuth_deg, elevation_deg; };

Place place_of(const Vec3& nose_m) {
  const double range = nose_m.norm();
  return {range / kFoot_m, std::atan2(nose_m.y(), -nose_m.x()) / kDeg, -std::asin(nose_m.z() / range) / kDeg};
}

/// Where the leg has taken a nose that was at `from` when it began.
Vec3 along(const Leg& leg, const Vec3& from, double t) {
  if (leg.to_place) {
    const Place a = place_of(from);
    const double x = rest_to_rest(t / leg.for_s);
    return nose_place(a.range_ft + x * (leg.range_ft - a.range_ft), a.azimuth_deg + x * (leg.azimuth_deg - a.azimuth_deg), a.elevation_deg + x * (leg.elevation_deg - a.elevation_deg));
  }
  const Vec3 in = from.normalized() * (-leg.closing_ftps * kFoot_m * t);
  return from + in + Vec3(0, leg.right_ftps, -leg.up_ftps) * (kFoot_m * t);
}

/// Weighted mean over a Hann window of this full width: corners of the way become blends.
std::vector<Relative> blended(const std::vector<Relative>& raw, double width_s) {
  const int reach = std::max(1, static_cast<int>(0.5 * width_s * kControlRate_hz));
  std::vector<double> weight(static_cast<std::size_t>(2 * reach + 1));
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) sum += weight[static_cast<std::size_t>(k + reach)] = 0.5 + 0.5 * std::cos(std::numbers::pi * k / (reach + 1.0));
  std::vector<Relative> out(raw.size());
  const int last = static_cast<int>(raw.size()) - 1;
  for (int i = 0; i <= last; ++i) {
    Relative r{Vec3::Zero(), 0};
    for (int k = -reach; k <= reach; ++k) {
      const int j = i + k;
      const Relative& edge = raw[static_cast<std::size_t>(std::clamp(j, 0, last))];
      // Beyond the ends the way goes on straight.
      const Vec3 beyond = j < 0 ? Vec3(j * (raw[1].nose_m - raw[0].nose_m)) : j > last ? Vec3((j - last) * (raw[raw.size() - 1].nose_m - raw[raw.size() - 2].nose_m)) : Vec3::Zero();
      const double w = weight[static_cast<std::size_t>(k + reach)] / sum;
      r.nose_m += w * (edge.nose_m + beyond);
      r.gusts += w * edge.gusts;
    }
    out[static_cast<std::size_t>(i)] = r;
  }
  return out;
}

}  // namespace

std::size_t control_count(const Scenario& s) {
  return static_cast<std::size_t>((kFirstFrame_s + s.frames / s.frame_rate_hz * 1.001 + kAfter_s - kControlStart_s) * kControlRate_hz);
}

Vec3 nose_place(double range_ft, double azimuth_deg, double elevation_deg) {
  const double el = elevation_deg * kDeg, az = azimuth_deg * kDeg;
  return range_ft * kFoot_m * Vec3(-std::cos(el) * std::cos(az), std::cos(el) * std::sin(az), -std::sin(el));
}

std::vector<Station> tanker_way(const Scenario& s) {
  const Vec3 wind_n(s.wind_north_mps, s.wind_east_mps, 0);
  Local here = local_from_geodetic(s.latitude_deg, s.longitude_deg, s.height_m);
  Vec3 ahead = here.R_e_n * rotation_z(s.heading_deg * kDeg).col(0);
  // The scenario's place and heading are those of time 0; from there forward and back.
  const auto fly = [&](double from_s, double step_s, std::size_t steps, auto&& keep) {
    Local at = here;
    Vec3 u = ahead;
    for (std::size_t k = 0; k <= steps; ++k) {
      const Vec3 down = at.R_e_n.col(2);
      u = (u - down * down.dot(u)).normalized();
      const double t = from_s + static_cast<double>(k) * step_s, bank = bank_at(s.turns, t - kFirstFrame_s);
      Mat3 R_e_h;
      R_e_h << u, down.cross(u), down;
      keep(Station{at.ecef, R_e_h, bank});
      const double middle = bank_at(s.turns, t + 0.5 * step_s - kFirstFrame_s), turned = step_s * kGravity * std::tan(middle) / s.speed_mps;
      const Eigen::AngleAxisd half(0.5 * turned, down), whole(turned, down);
      at = local_from_ecef(at.ecef + step_s * (s.speed_mps * (half * u) + at.R_e_n * wind_n));
      at.ecef += at.R_e_n.col(2) * (at.height_m - s.height_m);  // chords leave the level by micrometres
      u = whole * u;
    }
  };
  const auto before = static_cast<std::size_t>(-kControlStart_s * kControlRate_hz), count = control_count(s);
  std::vector<Station> back, out;
  fly(0, -1 / kControlRate_hz, before, [&](const Station& x) { back.push_back(x); });
  out.assign(back.rbegin(), back.rend());
  out.pop_back();
  fly(0, 1 / kControlRate_hz, count - 1 - before, [&](const Station& x) { out.push_back(x); });
  return out;
}

std::vector<Relative> receiver_way(const Scenario& s) {
  std::vector<Relative> raw(control_count(s));
  for (std::size_t i = 0; i < raw.size(); ++i) {
    double t = control_s(i) - kFirstFrame_s;
    Vec3 at = nose_place(s.range_ft, s.azimuth_deg, s.elevation_deg);
    double gusts = s.legs.empty() ? 1 : s.legs.back().gusts;
    for (std::size_t k = 0; k < s.legs.size(); ++k) {
      const Leg& leg = s.legs[k];
      const bool here = t < leg.for_s;
      if (k > 0 || t > 0 || !leg.to_place) at = along(leg, at, here ? t : leg.for_s);
      if (here) {
        gusts = leg.gusts;
        break;
      }
      t -= leg.for_s;
    }
    raw[i] = {at, gusts};
  }
  return blended(raw, s.blend_s);
}

double Sway::shape(int cycles, double x) {
  const double edge = std::min(0.5, 1.0 / cycles);
  return -rest_to_rest(x / edge) * rest_to_rest((1 - x) / edge) * std::sin(2 * std::numbers::pi * cycles * x);
}

Sway::Sway(const std::vector<WingRock>& rocks, bool tanker) {
  for (const WingRock& rock : rocks) {
    if (rock.tanker != tanker) continue;
    // The window bends the sine, so the largest acceleration of the shape is looked up, not worked out.
    constexpr double kStep = 1e-3;
    double most = 1e-9;
    for (double x = kStep; x < 1 - kStep; x += kStep) most = std::max(most, std::fabs(shape(rock.cycles, x + kStep) - 2 * shape(rock.cycles, x) + shape(rock.cycles, x - kStep)) / (kStep * kStep));
    const double length = rock.cycles * rock.period_s;
    parts_.push_back({kFirstFrame_s + rock.at_s, length, kGravity * std::tan(rock.bank_deg * kDeg) * length * length / most, rock.cycles});
  }
}

double Sway::at(double t) const {
  double out = 0;
  for (const Part& p : parts_)
    if (t > p.from_s && t < p.from_s + p.length_s) out += p.size_m * shape(p.cycles, (t - p.from_s) / p.length_s);
  return out;
}

}  // namespace cyclops::hil
