#include "hil/noise.hpp"

#include <cmath>
#include <numbers>
#include <vector>

namespace cyclops::hil {
namespace {

/// Quantile by bisection of the error function: slow, exact enough, called 65536 times once.
double quantile(double p) {
  double low = -6, high = 6;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double lattice(std::int64_t i, std::int64_t j, std::uint64_t seed) { return uniform(key(seed, static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(j))); }

double value_noise(double x, double y, std::uint64_t seed) {
  const double fx = std::floor(x), fy = std::floor(y);
  const auto i = static_cast<std::int64_t>(fx), j = static_cast<std::int64_t>(fy);
  const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
  const double a = smooth(x - fx), b = smooth(y - fy);
  const double low = lattice(i, j, seed) * (1 - a) + lattice(i + 1, j, seed) * a;
  const double high = lattice(i, j + 1, seed) * (1 - a) + lattice(i + 1, j + 1, seed) * a;
  return low * (1 - b) + high * b;
}

}  // namespace

const float* normal_table() {
  static const std::vector<float> table = [] {
    std::vector<float> t(65536);
    for (std::size_t i = 0; i < t.size() / 2; ++i) {
      t[i] = static_cast<float>(quantile((static_cast<double>(i) + 0.5) / 65536));
      t[t.size() - 1 - i] = -t[i];
    }
    return t;
  }();
  return table.data();
}

double normal(std::uint64_t bits) {
  const double u = 1 - uniform(bits), v = uniform(mixed(bits));
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

double fbm(double x, double y, int octaves, std::uint64_t seed) {
  double sum = 0, weight = 0.5, norm = 0;
  for (int o = 0; o < octaves; ++o) {
    sum += weight * value_noise(x, y, seed + static_cast<std::uint64_t>(o));
    norm += weight;
    weight *= 0.5;
    x = 2.03 * x + 17.1;
    y = 2.03 * y - 9.7;
  }
  return sum / norm;
}

}  // namespace cyclops::hil
