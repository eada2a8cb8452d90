#include "detect/corner_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/result.hpp"
#include "detect/corner_rows.hpp"

namespace cyclops {
namespace {

constexpr float kLowest = -std::numeric_limits<float>::infinity();
constexpr int kNoRow = std::numeric_limits<int>::min();

/// No row of v - reach .. v + reach is missing.
bool clear(const RowMask* missing, int v, int reach, const PixelRect& domain) {
  if (missing == nullptr) return true;
  for (int w = std::max(v - reach, domain.v0); w <= std::min(v + reach, domain.v1 - 1); ++w)
    if (missing->missing(w)) return false;
  return true;
}

void read_pixels(const KernelJob& job, int v, int u, int n, float* out) {
  if (job.level != nullptr) {
    if (job.image.format == PixelFormat::kMono8) {
      for (int i = 0; i < n; ++i) out[i] = job.level[job.image.row8(v)[u + i]];
    } else {
      for (int i = 0; i < n; ++i) out[i] = job.level[job.image.row16(v)[u + i]];
    }
  } else if (job.image.format == PixelFormat::kMono8) {
    rows::to_float(job.image.row8(v) + u, n, out);
  } else {
    rows::to_float(job.image.row16(v) + u, n, out);
  }
}

}  // namespace

KernelConfig kernel_config(double gaussian_sigma_px, int gaussian_size, int nms_radius_px, double eps) {
  KernelConfig c;
  c.half = gaussian_size / 2;
  c.radius = nms_radius_px;
  c.eps = static_cast<float>(eps);
  CYCLOPS_ASSERT(c.half >= 1 && c.half <= KernelConfig::kMaxHalf && gaussian_size % 2 == 1);
  CYCLOPS_ASSERT(c.radius >= 1 && c.radius <= KernelConfig::kMaxRadius);
  const auto gauss = [&](int k) { return std::exp(-0.5 * k * k / (gaussian_sigma_px * gaussian_sigma_px)); };
  double total = gauss(0);
  for (int k = 1; k <= c.half; ++k) total += 2 * gauss(k);
  for (int k = 0; k <= c.half; ++k) c.weight[static_cast<std::size_t>(k)] = static_cast<float>(gauss(k) / total);
  return c;
}

CornerKernel::CornerKernel(const KernelConfig& config) : config_(config) {
  lowest_.fill(kLowest);
  for (Row& row : measure_) row.fill(kLowest);
}

KernelResult CornerKernel::run(const KernelJob& job, std::span<Peak> peaks, float* picture) {
  KernelResult result;
  for (int u = job.measure.u0; u < job.measure.u1; u += kStrip) {
    const int end = std::min(u + kStrip, job.measure.u1);
    run_strip(job, {u, end, std::max(u - config_.radius, job.measure.u0), std::min(end + config_.radius, job.measure.u1)}, peaks, picture, result);
  }
  return result;
}

void CornerKernel::run_strip(const KernelJob& job, const Strip& strip, std::span<Peak> peaks, float* picture, KernelResult& result) {
  const auto& [u0, v0, u1, v1] = job.measure;
  const int sum0 = std::max(strip.own0, job.mean.u0), sum1 = std::min(strip.own1, job.mean.u1);
  pixel_row_.fill(kNoRow);
  for (int v = v0 - config_.half; v < v0 + config_.half; ++v) products(job, strip, v);
  for (int v = v0; v < v1; ++v) {
    products(job, strip, v + config_.half);
    const float* row = measure(job, strip, v) - strip.m0;  // indexed by column of the image
    if (v >= job.mean.v0 && v < job.mean.v1 && sum0 < sum1 && clear(job.missing, v, config_.half + 1, job.domain)) {
      result.sum += rows::sum(row + sum0, sum1 - sum0);
      result.pixels += sum1 - sum0;
    }
    if (picture != nullptr) std::copy(row + strip.own0, row + strip.own1, picture + static_cast<std::ptrdiff_t>(v - v0) * (u1 - u0) + strip.own0 - u0);
    search(job, strip, v - config_.radius, peaks, result);
  }
  for (int v = v1 - config_.radius; v < v1; ++v) search(job, strip, v, peaks, result);
}

/// Row v as float, from column m0 - half - 1 on. Outside the domain as the job says.
const float* CornerKernel::pixels(const KernelJob& job, const Strip& strip, int v) {
  const auto slot = static_cast<std::size_t>((v + 3 * kMaxImageSide) % 3);
  float* out = pixel_[slot].data();
  if (pixel_row_[slot] == v) return out;
  pixel_row_[slot] = v;
  const int first = strip.m0 - config_.half - 1, n = strip.m1 - strip.m0 + 2 * config_.half + 2;
  const int a = std::clamp(job.domain.u0 - first, 0, n), b = std::clamp(job.domain.u1 - first, 0, n);
  const bool exists = v >= job.domain.v0 && v < job.domain.v1;
  if (job.zero_outside && !exists) {
    std::fill(out, out + n, 0.0F);
    return out;
  }
  read_pixels(job, std::clamp(v, job.domain.v0, job.domain.v1 - 1), first + a, b - a, out + a);
  std::fill(out, out + a, job.zero_outside ? 0.0F : out[a]);
  std::fill(out + b, out + n, job.zero_outside ? 0.0F : out[b - 1]);
  return out;
}

/// Row v of X^2, Y^2 and XY into its ring, from column m0 - half on; zero outside the domain and beside missing rows.
void CornerKernel::products(const KernelJob& job, const Strip& strip, int v) {
  const int taps = 2 * config_.half + 1, first = strip.m0 - config_.half, n = strip.m1 - strip.m0 + 2 * config_.half;
  Triple& out = product_[static_cast<std::size_t>((v + kMaxImageSide * taps) % taps)];
  if (v < job.domain.v0 || v >= job.domain.v1 || !clear(job.missing, v, 1, job.domain)) {
    for (Row& kind : out) std::fill(kind.begin(), kind.begin() + n, 0.0F);
    return;
  }
  rows::products(pixels(job, strip, v - 1), pixels(job, strip, v), pixels(job, strip, v + 1), lanes::round_up(n), out[0].data(),
                 out[1].data(), out[2].data());
  const int a = std::clamp(job.domain.u0 - first, 0, n), b = std::clamp(job.domain.u1 - first, 0, n);
  for (Row& kind : out) {
    std::fill(kind.begin(), kind.begin() + a, 0.0F);
    std::fill(kind.begin() + b, kind.begin() + n, 0.0F);
  }
}

/// Row v of the measure and of its largest values along the row. Returns the value at column m0.
const float* CornerKernel::measure(const KernelJob&, const Strip& strip, int v) {
  const int taps = 2 * config_.half + 1, ring = 2 * config_.radius + 1, n = strip.m1 - strip.m0, n8 = lanes::round_up(n);
  const float* row[2 * KernelConfig::kMaxHalf + 1];
  for (int k = 0; k < taps; ++k)
    row[k] = product_[static_cast<std::size_t>((v - config_.half + k + kMaxImageSide * taps) % taps)][0].data();
  const auto slot = static_cast<std::size_t>(v % ring);
  float* x = measure_[slot].data() + kPad;
  rows::with_constant<KernelConfig::kMaxHalf>(config_.half, [&]<int Half> {
    rows::weigh_down<Half>(config_.weight.data(), row, kRow, lanes::round_up(n + 2 * Half), down_[0].data());
    rows::weigh_across<Half>(config_.weight.data(), down_[0].data(), kRow, config_.eps, n8, x);
  });
  std::fill(x + n, x + n8 + 2 * kPad, kLowest);
  rows::with_constant<KernelConfig::kMaxRadius>(config_.radius, [&]<int Radius> {
    float* before = before_[slot].data() + kPad;
    rows::largest_before<Radius>(x, n8 + kPad, before);
    rows::largest_around<Radius>(x, before, n8, around_[slot].data() + kPad);
  });
  return x;
}

/// Maxima of row v, whose square is complete.
void CornerKernel::search(const KernelJob& job, const Strip& strip, int v, std::span<Peak> peaks, KernelResult& result) {
  const int begin = std::max(strip.own0, job.search.u0), end = std::min(strip.own1, job.search.u1);
  if (v < job.search.v0 || v >= job.search.v1 || begin >= end || !clear(job.missing, v, config_.half + 1, job.domain)) return;
  const int ring = 2 * config_.radius + 1;
  const float* around[2 * KernelConfig::kMaxRadius + 1];
  for (int k = 0; k < ring; ++k) {
    const int w = v - config_.radius + k;
    const bool exists = w >= job.measure.v0 && w < job.measure.v1;
    around[k] = (exists ? around_[static_cast<std::size_t>(w % ring)] : lowest_).data();
  }
  const auto slot = static_cast<std::size_t>(v % ring);
  const int shift = kPad - strip.m0;
  rows::with_constant<KernelConfig::kMaxRadius>(config_.radius, [&]<int Radius> {
    rows::maxima<Radius>(measure_[slot].data(), before_[slot].data(), around, begin + shift, end + shift, [&](int i) {
      if (result.peaks == peaks.size()) return void(++result.lost);
      peaks[result.peaks++] = {measure_[slot][static_cast<std::size_t>(i)], static_cast<std::uint16_t>(i - shift), static_cast<std::uint16_t>(v)};
    });
  });
}

}  // namespace cyclops
