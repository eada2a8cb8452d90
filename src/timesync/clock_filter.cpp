#include "timesync/clock_filter.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops {
namespace {

constexpr double kSurprising = 3;     // sigma
constexpr double kMemory = 64;        // pairs over which the scatter is averaged
constexpr double kForgets_s = 3600;   // a rate kept over a step is not doubted more than after this time
constexpr double kMostScatter = 9;    // one pair counts for at most so many times the expected square

double square(double x) { return x * x; }

}  // namespace

void ClockFilter::forget() {
  rate_ = 0;
  rate_seen_ = false;
  p_ = {0, 0, square(noise_.unknown_rate * 1e9)};
  stamp_ns2_ = square(noise_.stamp_ns);
  forget_offset();
}

void ClockFilter::forget_offset() {
  pairs_ = 0;
  offset_ns_ = 0;
}

ClockFilter::Covariance ClockFilter::carried(double dt_s) const {
  const double dt = std::abs(dt_s), wander2 = square(noise_.wander_per_rs * 1e9), jitter2 = square(noise_.jitter_ns_per_rs);
  Covariance p = p_;
  p.oo += 2 * dt_s * p_.orr + dt * dt * p_.rr + jitter2 * dt + wander2 * dt * dt * dt / 3;
  p.orr += dt_s * p_.rr + wander2 * dt * dt_s / 2;
  p.rr += wander2 * dt;
  return p;
}

void ClockFilter::add(std::int64_t other_ns, Time service, Duration scatter) {
  const double given2 = square(std::max(static_cast<double>(scatter.ns), noise_.least_stamp_ns));
  if (pairs_++ == 0) {
    const double since_s = rate_seen_ ? std::clamp(static_cast<double>(other_ns - other_.ns) * 1e-9, 0.0, kForgets_s) : 0;
    rate_seen_ = true;
    p_ = {std::max(given2, stamp_ns2_), 0, p_.rr + square(noise_.wander_per_rs * 1e9) * since_s};
    other_ = {other_ns};
    service_ = service;
    return;
  }
  const double dt_s = static_cast<double>(other_ns - other_.ns) * 1e-9;
  const double innovation = -static_cast<double>((at(other_ns) - service).ns);
  Covariance p = carried(dt_s);
  double noise = std::max(stamp_ns2_, given2);
  const double expected = p.oo + noise;
  if (p.oo < noise) {        // else the innovation tells of the state, not of the stamp
    const double seen = std::min(square(innovation), kMostScatter * expected) - p.oo;
    stamp_ns2_ = std::max(stamp_ns2_ + (seen - stamp_ns2_) / std::min(kMemory, static_cast<double>(pairs_)), square(noise_.least_stamp_ns));
  }
  if (square(innovation) > square(kSurprising) * expected) noise = square(innovation / kSurprising) - p.oo;
  const double gain_o = p.oo / (p.oo + noise), gain_r = p.orr / (p.oo + noise);
  other_ = {other_ns};
  service_ = service;
  offset_ns_ = (gain_o - 1) * innovation;
  rate_ = std::clamp(rate_ + gain_r * innovation * 1e-9, -noise_.largest_rate, noise_.largest_rate);
  p_.oo = p.oo * (1 - gain_o);
  p_.orr = p.orr * (1 - gain_o);
  p_.rr = std::max(p.rr - gain_r * p.orr, 0.0);
}

Time ClockFilter::at(std::int64_t other_ns) const {
  const std::int64_t x = other_ns - other_.ns;
  return service_ + Duration{x + std::llround(offset_ns_ + rate_ * static_cast<double>(x))};
}

Duration ClockFilter::sigma_at(std::int64_t other_ns) const {
  return {std::llround(std::sqrt(std::max(carried(static_cast<double>(other_ns - other_.ns) * 1e-9).oo, 0.0)))};
}

double ClockFilter::surprise(std::int64_t other_ns, Time service) const {
  const double expected = carried(static_cast<double>(other_ns - other_.ns) * 1e-9).oo + stamp_ns2_;
  return static_cast<double>((service - at(other_ns)).ns) / std::sqrt(expected);
}

double ClockFilter::rate_sigma() const { return std::sqrt(p_.rr) * 1e-9; }
double ClockFilter::stamp_sigma_ns() const { return std::sqrt(stamp_ns2_); }

}  // namespace cyclops
