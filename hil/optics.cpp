#include "hil/optics.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops::hil {
namespace {

constexpr int kCoarse = 8;  // px between the points of the glare

/// Separable Gaussian, edges repeated.
void gauss(std::vector<float>& image, int width, int height, double sigma) {
  const int reach = std::max(1, static_cast<int>(std::ceil(3.5 * sigma)));
  std::vector<float> tap(static_cast<std::size_t>(reach) + 1);
  float sum = 0;
  for (int k = 0; k <= reach; ++k) {
    tap[static_cast<std::size_t>(k)] = static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma)));
    sum += (k == 0 ? 1.F : 2.F) * tap[static_cast<std::size_t>(k)];
  }
  for (float& t : tap) t /= sum;
  const auto n = static_cast<std::size_t>(width), r = static_cast<std::size_t>(reach);
  std::vector<float> across(image.size()), line(n + 2 * r);
  for (int v = 0; v < height; ++v) {
    const float* in = image.data() + static_cast<std::size_t>(v) * n;
    std::copy(in, in + n, line.begin() + reach);
    std::fill(line.begin(), line.begin() + reach, in[0]);
    std::fill(line.end() - reach, line.end(), in[n - 1]);
    float* out = across.data() + static_cast<std::size_t>(v) * n;
    for (std::size_t u = 0; u < n; ++u) out[u] = tap[0] * line[u + r];
    for (std::size_t k = 1; k <= r; ++k)
      for (std::size_t u = 0; u < n; ++u) out[u] += tap[k] * (line[u + r - k] + line[u + r + k]);
  }
  const auto row = [&](int v) { return across.data() + static_cast<std::size_t>(std::clamp(v, 0, height - 1)) * n; };
  for (int v = 0; v < height; ++v) {
    float* out = image.data() + static_cast<std::size_t>(v) * n;
    const float* own = row(v);
    for (std::size_t u = 0; u < n; ++u) out[u] = tap[0] * own[u];
    for (int k = 1; k <= reach; ++k) {
      const float *a = row(v - k), *b = row(v + k), t = tap[static_cast<std::size_t>(k)];
      for (std::size_t u = 0; u < n; ++u) out[u] += t * (a[u] + b[u]);
    }
  }
}

/// Scattered light: 45 % in a Gaussian of 12 px, 40 % of 88 px, the rest everywhere.
void scatter(std::vector<float>& image, int width, int height, float share) {
  const int nu = width / kCoarse + 2, nv = height / kCoarse + 2;
  std::vector<float> near(static_cast<std::size_t>(nu * nv)), count(near.size());
  double total = 0;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const auto at = static_cast<std::size_t>((v + kCoarse / 2) / kCoarse * nu + (u + kCoarse / 2) / kCoarse);
      const float l = image[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)];
      near[at] += l;
      count[at] += 1;
      total += l;
    }
  for (std::size_t i = 0; i < near.size(); ++i) near[i] = count[i] > 0 ? near[i] / count[i] : static_cast<float>(total / (width * static_cast<double>(height)));
  std::vector<float> wide = near;
  gauss(near, nu, nv, 12.0 / kCoarse);
  gauss(wide, nu, nv, 88.0 / kCoarse);
  const auto everywhere = static_cast<float>(0.15 * total / (width * static_cast<double>(height)));
  for (std::size_t i = 0; i < near.size(); ++i) near[i] = share * (0.45F * near[i] + 0.40F * wide[i] + everywhere);
  for (int v = 0; v < height; ++v) {
    const float y = static_cast<float>(v) / kCoarse, b = y - std::floor(y);
    const float *low = &near[static_cast<std::size_t>(v / kCoarse * nu)], *high = low + nu;
    float* out = &image[static_cast<std::size_t>(v) * static_cast<std::size_t>(width)];
    for (int u = 0; u < width; ++u) {
      const int i = u / kCoarse;
      const float a = static_cast<float>(u % kCoarse) / kCoarse;
      out[u] = (1 - share) * out[u] + (low[i] * (1 - a) + low[i + 1] * a) * (1 - b) + (high[i] * (1 - a) + high[i + 1] * a) * b;
    }
  }
}

}  // namespace

void through_lens(const OpticsLook& look, int width, int height, double focal_px, std::vector<float>& image) {
  if (look.blur_sigma_px > 0) gauss(image, width, height, look.blur_sigma_px);
  if (look.glare > 0) scatter(image, width, height, static_cast<float>(look.glare));
  if (look.vignette <= 0) return;
  const auto k = static_cast<float>(look.vignette / (focal_px * focal_px));
  for (int v = 0; v < height; ++v) {
    const float y = static_cast<float>(v) - 0.5F * static_cast<float>(height - 1);
    float* row = &image[static_cast<std::size_t>(v) * static_cast<std::size_t>(width)];
    for (int u = 0; u < width; ++u) {
      const float x = static_cast<float>(u) - 0.5F * static_cast<float>(width - 1), w = 1 / (1 + k * (x * x + y * y));
      row[u] *= w * w;
    }
  }
}

}  // namespace cyclops::hil
