#include "detect/corner_reference.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops {
namespace {

/// Value of one pixel as the job sees it.
template <class Real>
Real pixel(const KernelJob& job, int u, int v) {
  const PixelRect& d = job.domain;
  if (job.zero_outside && (u < d.u0 || u >= d.u1 || v < d.v0 || v >= d.v1)) return 0;
  u = std::clamp(u, d.u0, d.u1 - 1);
  v = std::clamp(v, d.v0, d.v1 - 1);
  const int value = job.image.format == PixelFormat::kMono8 ? job.image.row8(v)[u] : job.image.row16(v)[u];
  return static_cast<Real>(job.level != nullptr ? job.level[value] : value);
}

bool product_exists(const KernelJob& job, int u, int v) {
  const PixelRect& d = job.domain;
  if (u < d.u0 || u >= d.u1 || v < d.v0 || v >= d.v1) return false;
  for (int w = std::max(v - 1, d.v0); w <= std::min(v + 1, d.v1 - 1); ++w)
    if (job.missing != nullptr && job.missing->missing(w)) return false;
  return true;
}

template <class Real>
std::vector<Real> gaussian(int size, double sigma) {
  std::vector<Real> g;
  double total = 0;
  for (int k = -(size / 2); k <= size / 2; ++k) total += std::exp(-0.5 * k * k / (sigma * sigma));
  for (int k = 0; k <= size / 2; ++k) g.push_back(static_cast<Real>(std::exp(-0.5 * k * k / (sigma * sigma)) / total));
  return g;
}

/// Centre, then pairs outwards: the order of operations and where they round is part of the definition.
template <class Real, class At>
Real weighted(const std::vector<Real>& g, At&& at) {
  Real sum = g[0] * at(0);
  for (int k = 1; k < static_cast<int>(g.size()); ++k) sum = std::fma(g[static_cast<std::size_t>(k)], at(-k) + at(k), sum);
  return sum;
}

}  // namespace

template <class Real>
std::vector<Real> reference_measure(const KernelJob& job, int gaussian_size, double gaussian_sigma_px, double eps) {
  const auto g = gaussian<Real>(gaussian_size, gaussian_sigma_px);
  const auto product = [&](int kind, int u, int v) -> Real {
    if (!product_exists(job, u, v)) return 0;
    const Real x = pixel<Real>(job, u + 1, v) - pixel<Real>(job, u - 1, v);
    const Real y = pixel<Real>(job, u, v + 1) - pixel<Real>(job, u, v - 1);
    return kind == 0 ? x * x : kind == 1 ? y * y : x * y;
  };
  const auto smoothed = [&](int kind, int u, int v) {
    return weighted(g, [&](int du) { return weighted(g, [&](int dv) { return product(kind, u + du, v + dv); }); });
  };
  std::vector<Real> out;
  for (int v = job.measure.v0; v < job.measure.v1; ++v)
    for (int u = job.measure.u0; u < job.measure.u1; ++u) {
      const Real a = smoothed(0, u, v), b = smoothed(1, u, v), c = smoothed(2, u, v);
      out.push_back(std::fma(-c, c, a * b) / (a + b + static_cast<Real>(eps)));
    }
  return out;
}
template std::vector<float> reference_measure(const KernelJob&, int, double, double);
template std::vector<double> reference_measure(const KernelJob&, int, double, double);

std::vector<Peak> reference_maxima(const KernelJob& job, const std::vector<float>& measure, int radius) {
  const PixelRect& m = job.measure;
  const auto at = [&](int u, int v) { return measure[static_cast<std::size_t>((v - m.v0) * (m.u1 - m.u0) + u - m.u0)]; };
  const auto is_maximum = [&](int u, int v) {
    for (int y = std::max(v - radius, m.v0); y <= std::min(v + radius, m.v1 - 1); ++y)
      for (int x = std::max(u - radius, m.u0); x <= std::min(u + radius, m.u1 - 1); ++x) {
        const bool earlier = y < v || (y == v && x < u);
        if (earlier ? !(at(u, v) > at(x, y)) : !(at(u, v) >= at(x, y))) return false;
      }
    return true;
  };
  std::vector<Peak> out;
  for (int v = job.search.v0; v < job.search.v1; ++v)
    for (int u = job.search.u0; u < job.search.u1; ++u)
      if (is_maximum(u, v)) out.push_back({at(u, v), static_cast<std::uint16_t>(u), static_cast<std::uint16_t>(v)});
  return out;
}

}  // namespace cyclops
