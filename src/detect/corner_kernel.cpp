#include "detect/corner_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/result.hpp"
#include "detect/corner_rows.hpp"

namespace cyclops {
namespace {

constexpr float kLowest = -std::numeric_limits<float>::infinity();
constexpr int kAhead = 6;     // rows
constexpr int kWide = 128;    // columns from which on it pays
constexpr int kLine = 64;     // bytes of a line of the cache

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

/// Pixels of a row that will be read soon: the rows of a strip lie too far apart for the processor to foresee them.
void fetch(const ImageView& image, int v, int u, int n) {
  const int pixel = bytes_per_pixel(image.format);
  const std::uint8_t* row = image.row8(v) + u * pixel;
  for (int i = 0; i < n * pixel; i += kLine) __builtin_prefetch(row + i);
}

/// Calls f.operator()<N>() for the N in 1..Max that equals n.
template <int Max, class F>
void with_constant(int n, F&& f) {
  if constexpr (Max > 0) {
    if (n == Max) return f.template operator()<Max>();
    with_constant<Max - 1>(n, f);
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
  static_assert(kRow % lanes::kLanes == 0);
  with_constant<KernelConfig::kMaxHalf>(config.half, [&]<int Half>() {
    loops_.down = rows::weigh_down<Half>;
    loops_.across = rows::weigh_across<Half>;
  });
  with_constant<KernelConfig::kMaxRadius>(config.radius, [&]<int Radius>() {
    loops_.run = rows::largest_run<Radius>;
    loops_.around = rows::largest_around<Radius>;
    loops_.maxima = rows::maxima<Radius>;
  });
}

KernelResult CornerKernel::run(const KernelJob& job, std::span<Peak> peaks, float* picture) {
  KernelResult result;
  for (int u = job.measure.u0; u < job.measure.u1; u += kStrip) run_strip(job, strip_at(job, u), peaks, picture, result);
  return result;
}

CornerKernel::Strip CornerKernel::strip_at(const KernelJob& job, int u) const {
  const auto span = [&](int first, int n) {
    return Span{first, n, std::max(job.domain.u0 - first, 0), std::min(job.domain.u1 - first, n)};
  };
  const int end = std::min(u + kStrip, job.measure.u1), half = config_.half;
  const int m0 = std::max(u - config_.radius, job.measure.u0), n = std::min(end + config_.radius, job.measure.u1) - m0;
  return {u, end, m0, n, span(m0 - half - 1, n + 2 * half + 2), span(m0 - half, n + 2 * half)};
}

void CornerKernel::run_strip(const KernelJob& job, const Strip& strip, std::span<Peak> peaks, float* picture, KernelResult& result) {
  const auto& [u0, v0, u1, v1] = job.measure;
  const int half = config_.half, sum0 = std::max(strip.own0, job.mean.u0), sum1 = std::min(strip.own1, job.mean.u1);
  start(strip);
  load_pixels(job, strip.pixels, v0 - half - 1);
  load_pixels(job, strip.pixels, v0 - half);
  for (int w = v0 - half; w < v1 + half; ++w) {
    load_pixels(job, strip.pixels, w + 1);
    multiply(job, strip.products, w);
    const int v = w - half;  // the row whose products are complete
    if (v < v0) continue;
    const float* row = measure(strip) - strip.m0;  // by column of the image
    if (v >= job.mean.v0 && v < job.mean.v1 && sum0 < sum1 && clear(job.missing, v, half + 1, job.domain)) {
      result.sum += rows::sum(row + sum0, sum1 - sum0);
      result.pixels += sum1 - sum0;
    }
    if (picture != nullptr)
      std::copy(row + strip.own0, row + strip.own1, picture + static_cast<std::ptrdiff_t>(v - v0) * (u1 - u0) + strip.own0 - u0);
    search(job, strip, v - config_.radius, peaks, result);
  }
  for (int v = v1 - config_.radius; v < v1; ++v) {  // below the last row there is nothing
    measure_nothing(strip);
    search(job, strip, v, peaks, result);
  }
}

/// Empty rings: above the first row there is nothing.
void CornerKernel::start(const Strip& strip) {
  const auto fill = [](auto& ring, auto& rows, int n, auto&& row_of) {
    ring.reset(n);
    for (int i = 0; i < n; ++i) ring.set(i, row_of(rows[static_cast<std::size_t>(i)]));
  };
  const auto lowest = [&](Row& row) { return std::fill_n(row.data(), lanes::round_up(strip.columns), kLowest), row.data(); };
  fill(pixel_ring_, pixel_, 3, [](Row& row) { return row.data(); });
  fill(product_ring_, product_, 2 * config_.half + 1, [](Triple& kinds) { return kinds[0].data(); });
  fill(measured_ring_, measured_, config_.radius + 1,
       [](Measured& m) { return std::fill_n(m.value.data(), kPad, kLowest), m.value.data(); });
  fill(around_ring_, around_, config_.radius, lowest);
  fill(stack_ring_, stack_, config_.radius + 2, lowest);
}

/// Row v as float. Outside the domain as the job says.
void CornerKernel::load_pixels(const KernelJob& job, const Span& span, int v) {
  float* out = pixel_ring_.renew();
  const auto& [first, n, begin, end] = span;
  if (job.zero_outside && (v < job.domain.v0 || v >= job.domain.v1)) return void(std::fill_n(out, n, 0.0F));
  if (n > kWide) fetch(job.image, std::clamp(v + kAhead, job.domain.v0, job.domain.v1 - 1), first + begin, end - begin);
  read_pixels(job, std::clamp(v, job.domain.v0, job.domain.v1 - 1), first + begin, end - begin, out + begin);
  if (begin == 0 && end == n) return;
  std::fill(out, out + begin, job.zero_outside ? 0.0F : out[begin]);
  std::fill(out + end, out + n, job.zero_outside ? 0.0F : out[end - 1]);
}

/// X^2, Y^2 and XY of row v, the middle one of the pixel ring; zero outside the domain and beside missing rows.
void CornerKernel::multiply(const KernelJob& job, const Span& span, int v) {
  float* out = product_ring_.renew();
  const float* const* row = pixel_ring_.window();
  const auto& [first, n, begin, end] = span;
  const bool exists = v >= job.domain.v0 && v < job.domain.v1 && clear(job.missing, v, 1, job.domain);
  if (exists) rows::products(row[0], row[1], row[2], lanes::round_up(n), out, out + kRow, out + 2 * kRow);
  if (exists && begin == 0 && end == n) return;
  for (float* kind : {out, out + kRow, out + 2 * kRow}) {
    std::fill(kind, kind + (exists ? begin : n), 0.0F);
    std::fill(kind + (exists ? end : n), kind + n, 0.0F);
  }
}

/// The measure of the middle row of the product ring and its largest values. Returns the value at column m0.
const float* CornerKernel::measure(const Strip& strip) {
  float* row = measured_ring_.renew();
  float *value = row + kPad, *run = row + kRow;
  const int n = lanes::round_up(strip.columns);
  loops_.down(config_.weight.data(), product_ring_.window(), lanes::round_up(strip.products.n), down_[0].data());
  loops_.across(config_.weight.data(), down_[0].data(), config_.eps, n, value);
  std::fill_n(value + strip.columns, 2 * kPad, kLowest);
  loops_.run(row, lanes::round_up(kPad + strip.columns + 1), run);
  around_ring_.renew();
  loops_.around(value, run + kPad, n, around_ring_.window(), stack_ring_.renew());
  return value;
}

/// A row of no values, below the last one.
void CornerKernel::measure_nothing(const Strip& strip) {
  measured_ring_.renew();
  std::fill_n(around_ring_.renew(), strip.columns, kLowest);
  float* stack = stack_ring_.renew();
  std::fill_n(stack, strip.columns, kLowest);
  for (int k = 0; k < config_.radius; ++k)
    for (int i = 0; i < strip.columns; ++i) stack[i] = std::max(stack[i], around_ring_.window()[k][i]);
}

/// Maxima of row v, the oldest of the measure's ring.
void CornerKernel::search(const KernelJob& job, const Strip& strip, int v, std::span<Peak> peaks, KernelResult& result) {
  const int begin = std::max(strip.own0, job.search.u0) - strip.m0, end = std::min(strip.own1, job.search.u1) - strip.m0;
  if (v < job.search.v0 || v >= job.search.v1 || begin >= end || !clear(job.missing, v, config_.half + 1, job.domain)) return;
  const float* value = measured_ring_.window()[0] + kPad;
  const float *above = stack_ring_.window()[0], *below = stack_ring_.window()[config_.radius + 1];
  const int n = loops_.maxima(value, value + kRow, above, below, begin, end, hits_.data());
  for (int k = 0; k < n; ++k) {
    const int i = hits_[static_cast<std::size_t>(k)];
    if (result.peaks == peaks.size()) ++result.lost;
    else peaks[result.peaks++] = {value[i], static_cast<std::uint16_t>(i + strip.m0), static_cast<std::uint16_t>(v)};
  }
}

}  // namespace cyclops
