#include "hil/navigation_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/noise.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kSmallest_m = 1e-3, kSmallest_rad = 1e-5, kSmallest_mps = 1e-3;  // sigmas of a perfect system
constexpr double kSharedTau_s = 300;

/// Next value of a Gauss-Markov process of unit variance.
double next(double last, double fresh, double step_s, double tau_s) {
  const double keep = std::exp(-step_s / tau_s);
  return keep * last + std::sqrt(1 - keep * keep) * fresh;
}

/// Attitude with the direction of flight in place of heading and pitch.
Mat3 along_path(const AircraftState& s) {
  const Local level = local_from_ecef(s.position_e);
  const Vec3 v = level.R_e_n.transpose() * s.velocity_e;
  const HeadingPitchBank a = heading_pitch_bank(level.R_e_n.transpose() * s.R_e_b);
  return level.R_e_n * rotation_z(std::atan2(v.y(), v.x())) * rotation_y(std::atan2(-v.z(), std::hypot(v.x(), v.y()))) * rotation_x(a.bank);
}

void move_to_point(AircraftState& s, const Mat3& R_e_b, const Vec3& point) {
  s.velocity_e += R_e_b * s.rate_b_rps.cross(point);
  s.position_e += R_e_b * point;
}

}  // namespace

NavigationErrors::NavigationErrors(const Navigation& n, std::uint64_t seed, std::size_t samples)
    : n_(n), receiver_(samples), tanker_(samples), shared_(samples, Vec3::Zero()), course_(samples, 1.0) {
  const double step = 1 / n_.rate_hz;
  std::uint64_t aircraft = 0;
  for (std::vector<Draw>* x : {&receiver_, &tanker_}) {
    ++aircraft;
    for (std::size_t i = 0; i < samples; ++i)
      for (std::size_t k = 0; k < 12; ++k) {
        const double fresh = normal(key(key(seed, aircraft), i, k));
        (*x)[i][k] = k >= 6 || i == 0 ? fresh : next((*x)[i - 1][k], fresh, step, k < 3 ? n_.position_tau_s : n_.attitude_tau_s);
      }
  }
  for (std::size_t i = 0; i < samples; ++i)
    for (int k = 0; k < 3; ++k) {
      const double fresh = normal(key(key(seed, 3), i, static_cast<std::uint64_t>(k)));
      shared_[i][k] = i == 0 ? fresh : next(shared_[i - 1][k], fresh, step, kSharedTau_s);
    }
}

void NavigationErrors::set_course(std::vector<double> course) {
  CYCLOPS_ASSERT(course.size() == course_.size());
  course_ = std::move(course);
  std::vector<double> sorted = course_;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  usual_ = sorted[sorted.size() / 2];
}

AircraftState NavigationErrors::one(const AircraftState& truth, const Draw& x, const Vec3& shared, double scale, double stated) const {
  AircraftState out = truth;
  if (!n_.is_true) {
    const Mat3 R_e_n = local_from_ecef(truth.position_e).R_e_n;
    out.position_e += R_e_n * (scale * n_.position_sigma_m * Vec3(x[0], x[1], x[2]) + n_.shared_position_sigma_m * shared);
    out.R_e_b = truth.R_e_b * so3_exp(scale * n_.attitude_sigma_deg * kDeg * Vec3(x[3], x[4], x[5])).toRotationMatrix();
    out.velocity_e += n_.velocity_sigma_mps * Vec3(x[6], x[7], x[8]);
    out.rate_b_rps += n_.rate_sigma_dps * kDeg * Vec3(x[9], x[10], x[11]);
  }
  const double size = n_.is_true ? 0 : stated * n_.stated_sigma_factor;
  out.position_sigma_m = Vec3::Constant(std::max(size * n_.position_sigma_m, kSmallest_m));
  out.velocity_sigma_mps = std::max(n_.is_true ? 0 : n_.velocity_sigma_mps, kSmallest_mps);
  out.attitude_sigma_rad = Vec3::Constant(std::max(size * n_.attitude_sigma_deg * kDeg, kSmallest_rad));
  return out;
}

Said NavigationErrors::said(const AircraftState& receiver, const AircraftState& tanker, std::size_t sample) const {
  return said_at_scale(receiver, tanker, sample, course_[sample]);
}

Said NavigationErrors::said_at_scale(const AircraftState& r, const AircraftState& k, std::size_t i, double scale) const {
  const double stated = n_.stated_sigma_follows ? scale : usual_;
  Said out{one(r, receiver_[i], shared_[i], scale, stated), one(k, tanker_[i], shared_[i], scale, stated)};
  // The antennas are where they are, whatever the attitude that is said.
  move_to_point(out.receiver, r.R_e_b, n_.receiver_point_m);
  move_to_point(out.tanker, k.R_e_b, n_.tanker_point_m);
  if (n_.reduction == Reduction::kFlightPath && !n_.is_true) {
    const Mat3 R_r_k = out.receiver.R_e_b.transpose() * out.tanker.R_e_b;
    out.receiver.R_e_b = along_path(out.receiver);
    out.tanker.R_e_b = out.receiver.R_e_b * R_r_k;
  }
  return out;
}

std::vector<std::vector<std::int64_t>> arrivals(const Link& link, double rate_hz, std::int64_t start_ns, std::size_t samples, std::uint64_t seed) {
  std::vector<std::vector<std::int64_t>> out(samples);
  std::int64_t last = INT64_MIN;
  double silent_until = -1;
  for (std::size_t i = 0; i < samples; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    if (uniform(key(seed, 1, i)) < link.dropouts_per_minute / 60 / rate_hz) silent_until = std::max(silent_until, t - link.dropout_s * std::log(1 - uniform(key(seed, 2, i))));
    const double late_ms = link.latency_ms + link.jitter_ms * (2 * uniform(key(seed, 3, i)) - 1);
    std::int64_t arrival = start_ns + static_cast<std::int64_t>(std::llround((t + late_ms * 1e-3) * 1e9));
    if (t < silent_until) continue;
    if (uniform(key(seed, 4, i)) < link.swapped_share) arrival += static_cast<std::int64_t>(1.5e9 / rate_hz);  // the next one comes first
    else last = arrival = std::max(arrival, last == INT64_MIN ? arrival : last + 20'000);
    out[i].push_back(arrival);
    if (uniform(key(seed, 5, i)) < link.duplicate_share) out[i].push_back(arrival + static_cast<std::int64_t>(0.4e9 / rate_hz));
  }
  return out;
}

}  // namespace cyclops::hil
