#include "hil/wander.hpp"

#include <cmath>
#include <numbers>

#include "hil/noise.hpp"

namespace cyclops::hil {
namespace {

constexpr double kLowest = 0.15, kHighest = 8;  // times the frequency of the mode
constexpr double kTop_hz = 2.5;                 // nothing of an aircraft's size moves faster than this

}  // namespace

Wander::Wander(const WanderShape& shape, std::uint64_t seed) {
  const double low = kLowest * shape.frequency_hz, high = std::fmin(kHighest * shape.frequency_hz, kTop_hz);
  const double step = std::log(high / low) / static_cast<double>(sines_.size());
  double sum = 0;
  for (std::size_t k = 0; k < sines_.size(); ++k) {
    // One sine in each band of equal width on a logarithmic scale, at a drawn place in it: no common period.
    const double f = low * std::exp(step * (static_cast<double>(k) + uniform(key(seed, 1, k))));
    const double r = f / shape.frequency_hz;
    const double power = f * step / ((1 - r * r) * (1 - r * r) + 4 * shape.damping * shape.damping * r * r);
    sines_[k] = {std::sqrt(2 * power), 2 * std::numbers::pi * f, 2 * std::numbers::pi * uniform(key(seed, 2, k))};
    sum += power;
  }
  for (Sine& s : sines_) s.amplitude *= shape.sigma / std::sqrt(sum);
}

double Wander::at(double t) const {
  double out = 0;
  for (const Sine& s : sines_) out += s.amplitude * std::sin(s.rate_rps * t + s.phase);
  return out;
}

}  // namespace cyclops::hil
