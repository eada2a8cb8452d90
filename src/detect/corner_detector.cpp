#include "detect/corner_detector.hpp"

#include <algorithm>
#include <cmath>

#include "detect/pixel_noise.hpp"
#include "geometry/ellipse.hpp"

namespace cyclops {
namespace {

PixelRect whole(const ImageView& image) { return {0, 0, image.width, image.height}; }

std::uint32_t count_missing(const RowMask* missing, const PixelRect& box) {
  std::uint32_t n = 0;
  for (int v = box.v0; missing != nullptr && v < box.v1; ++v) n += missing->missing(v) ? 1U : 0U;
  return n * static_cast<std::uint32_t>(box.u1 - box.u0);
}

/// Pixels of a row at or above the limit. Most rows have none, and the largest value alone says so fast.
template <class Pixel>
std::uint32_t count_row(const Pixel* row, int n, int limit) {
  Pixel largest = 0;
  for (int i = 0; i < n; ++i) largest = std::max(largest, row[i]);
  if (largest < limit) return 0;
  return static_cast<std::uint32_t>(std::count_if(row, row + n, [&](Pixel p) { return p >= limit; }));
}

std::uint32_t count_saturated(const ImageView& image, const RowMask* missing, const PixelRect& box, int limit) {
  std::uint32_t n = 0;
  for (int v = box.v0; limit > 0 && v < box.v1; ++v) {
    if (missing != nullptr && missing->missing(v)) continue;
    n += image.format == PixelFormat::kMono8 ? count_row(image.row8(v) + box.u0, box.u1 - box.u0, limit)
                                             : count_row(image.row16(v) + box.u0, box.u1 - box.u0, limit);
  }
  return n;
}

SubpixelConfig subpixel_config(const DetectConfig& c) {
  return {std::max(c.subpixel_window_px, 2), c.subpixel_iterations, c.subpixel_max_shift_px, c.subpixel_sigma_px};
}

std::size_t peaks_of(int width, int height, int radius) {  // two maxima are more than `radius` apart in row or column
  const auto along = [&](int n) { return static_cast<std::size_t>(n / (radius + 1) + 1); };
  return along(width) * along(height);
}

constexpr int kNoiseHalf = 15;  // of the square whose noise counts for a single corner
constexpr std::uint32_t kClippedArea = 5;  // fewer saturated pixels are a defect or a glint

}  // namespace

CornerDetector::CornerDetector(const DetectConfig& config, int max_width, int max_height)
    : config_(config),
      max_width_(max_width),
      max_height_(max_height),
      kernel_(kernel_config(config.gaussian_sigma_px, config.gaussian_size, config.nms_radius_px, config.noble_eps)),
      refiner_(subpixel_config(config)),
      peaks_(peaks_of(max_width, max_height, config.nms_radius_px)),
      found_(2 * kMaxCorners),
      order_(std::max(peaks_.size(), found_.size())),
      facts_(kMaxSubImages) {
  CYCLOPS_ASSERT(max_width <= kMaxImageSide && max_height <= kMaxImageSide);
}

void CornerDetector::detect(const ImageView& image, const RowMask* missing, const SubImageSet& boxes, CornerSet& out) {
  CYCLOPS_ASSERT(image.width <= max_width_ && image.height <= max_height_);
  if (missing != nullptr && missing->count() == 0) missing = nullptr;
  saturation_ = config_.saturation_counts >= 0 ? config_.saturation_counts : (1 << bits_per_pixel(image.format)) - 1;
  out.items.clear();
  out.overflow = out.unreadable_px = 0;
  found_size_ = 0;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    const SubImage& b = boxes[i];
    const PixelRect box = PixelRect{b.u0, b.v0, b.u0 + b.width, b.v0 + b.height}.within(whole(image));
    if (!box.empty()) search_box(image, missing, box, i, out);
  }
  found_size_ = keep_strongest(found_.data(), found_size_, static_cast<std::size_t>(config_.max_corners), out);
  for (std::size_t i = 0; i < found_size_; ++i) report(image, missing, found_[i], out);
}

void CornerDetector::detect_near(const ImageView& image, const RowMask* missing, const PredictionSet& expected, CornerSet& out) {
  if (config_.subpixel_window_px == 0 || config_.near_px <= 0) return;
  const std::size_t before = out.items.size();
  for (const Prediction& p : expected.items) {
    if (p.visibility != Visibility::kVisible) continue;
    const auto near = [&](const Corner& c) { return c.kind == PointKind::kCorner && (c.uv_px - p.uv_px).squaredNorm() <= config_.near_px * config_.near_px; };
    if (std::any_of(out.items.begin(), out.items.begin() + before, near)) continue;
    const int u = static_cast<int>(std::lround(p.uv_px.x())), v = static_cast<int>(std::lround(p.uv_px.y()));
    if (u < 0 || v < 0 || u >= image.width || v >= image.height) continue;  // within half a pixel of the border
    const PixelRect around = PixelRect{u - kNoiseHalf, v - kNoiseHalf, u + kNoiseHalf + 1, v + kNoiseHalf + 1}.within(whole(image));
    const BoxFacts facts{estimate_noise_variance(image, around, missing), true};
    const Localised fine = refiner_.refine(image, u, v, noise_variance(image, facts, {0, static_cast<std::uint16_t>(u), static_cast<std::uint16_t>(v)}));
    if (!fine.converged || (fine.uv_px - p.uv_px).norm() > config_.near_px) continue;
    if (larger_sigma(fine.cov_px2) > config_.near_sigma_px) continue;
    const int fu = static_cast<int>(std::lround(fine.uv_px.x())), fv = static_cast<int>(std::lround(fine.uv_px.y()));
    const Support around_corner = support(image, missing, facts, fu, fv, refiner_.reach());
    if (around_corner == Support::kUnreadable) continue;
    Corner corner{fine.uv_px, fine.cov_px2, 0, true};
    clip(around_corner, corner);
    corner.feature = p.feature;
    if (!out.items.try_push_back(corner)) ++out.overflow;
  }
}

/// Appends to found_ what exceeds the threshold.
void CornerDetector::search_box(const ImageView& image, const RowMask* missing, const PixelRect& box, std::uint32_t index, CornerSet& out) {
  const std::uint32_t saturated = count_saturated(image, missing, box, saturation_);
  out.unreadable_px += saturated + count_missing(missing, box);
  const KernelJob job = job_for(image, missing, box);
  if (job.search.empty()) return;
  BoxFacts& facts = facts_[index];
  const bool estimate = config_.noise == NoiseSource::kEstimate && needs_noise();
  facts = {estimate ? estimate_noise_variance(image, box, missing) : 0, saturated > 0};
  // The measure of an equalised image is in other counts: the noise of the pixels says nothing about it.
  const double floor_noise = job.level == nullptr ? config_.floor_noise : 0;
  const KernelResult result = kernel_.run(job, peaks_);
  const double least = threshold(result, box);
  const auto end = std::remove_if(peaks_.begin(), peaks_.begin() + static_cast<std::ptrdiff_t>(result.peaks), [&](const Peak& p) {
    return !(p.measure > least) || p.measure < floor_noise * noise_variance(image, facts, p) ||
           support(image, missing, facts, p.u, p.v, config_.gaussian_size / 2 + 1) == Support::kUnreadable;
  });
  const std::size_t n = keep_strongest(peaks_.data(), static_cast<std::size_t>(end - peaks_.begin()),
                                       static_cast<std::size_t>(config_.max_corners_per_box), out);
  if (found_size_ + n > found_.size())
    found_size_ = keep_strongest(found_.data(), found_size_, static_cast<std::size_t>(config_.max_corners), out);
  for (std::size_t i = 0; i < n; ++i) found_[found_size_++] = {peaks_[i], index};
}

KernelJob CornerDetector::job_for(const ImageView& image, const RowMask* missing, const PixelRect& box) {
  const bool thesis = config_.mode == DetectMode::kThesis;
  KernelJob job;
  job.image = image;
  job.domain = thesis ? box : whole(image);
  job.zero_outside = thesis;
  job.search = box.grown(-config_.border_px);
  job.mean = config_.mean_over == MeanOver::kBox ? box : job.search;
  job.measure = thesis || config_.mean_over == MeanOver::kBox ? box : job.search.grown(config_.nms_radius_px).within(job.domain);
  job.missing = missing;
  if (config_.equalise == Equalise::kBox) job.level = equaliser_.levels(image, box, missing);
  return job;
}

double CornerDetector::threshold(const KernelResult& result, const PixelRect& box) const {
  double mean = result.mean();
  if (config_.mean_over == MeanOver::kClearedBox) mean = result.sum / (static_cast<double>(box.u1 - box.u0) * (box.v1 - box.v0));
  return std::max({config_.threshold_factor * mean, config_.floor_counts2, 0.0});
}

CornerDetector::Support CornerDetector::support(const ImageView& image, const RowMask* missing, const BoxFacts& facts, int u, int v, int reach) const {
  if (missing == nullptr && !facts.saturated) return Support::kClear;
  const PixelRect around = PixelRect{u - reach, v - reach, u + reach + 1, v + reach + 1}.within(whole(image));
  if (count_missing(missing, around) > 0) return Support::kUnreadable;
  const std::uint32_t saturated = facts.saturated ? count_saturated(image, missing, around, saturation_) : 0;
  if (saturated == 0) return Support::kClear;
  return saturated < kClippedArea || config_.saturation_sigma_px < 0 ? Support::kUnreadable : Support::kClipped;
}

/// The blurred edge of a clipped area lies beside the true one.
void CornerDetector::clip(Support support, Corner& corner) const {
  if (support == Support::kClipped) corner.cov_px2 += config_.saturation_sigma_px * config_.saturation_sigma_px * Mat2::Identity();
}

/// Strongest `room` of n items stay, in their order; the earlier of equals. Returns how many.
template <class T>
std::size_t CornerDetector::keep_strongest(T* items, std::size_t n, std::size_t room, CornerSet& out) {
  if (n <= room) return n;
  const auto measure = [&](std::uint32_t i) {
    if constexpr (std::is_same_v<T, Peak>) return items[i].measure;
    else return items[i].peak.measure;
  };
  const auto first = order_.begin(), last = first + static_cast<std::ptrdiff_t>(n), kept = first + static_cast<std::ptrdiff_t>(room);
  for (std::uint32_t i = 0; i < n; ++i) order_[i] = i;
  const auto stronger = [&](std::uint32_t a, std::uint32_t b) { return measure(a) != measure(b) ? measure(a) > measure(b) : a < b; };
  std::nth_element(first, kept, last, stronger);
  std::sort(first, kept);
  for (std::size_t i = 0; i < room; ++i) items[i] = items[order_[i]];
  out.overflow += static_cast<std::uint32_t>(n - room);
  return room;
}

/// kModel: by the brightness of the corner's own pixel.
double CornerDetector::noise_variance(const ImageView& image, const BoxFacts& facts, const Peak& p) const {
  if (config_.noise == NoiseSource::kEstimate) return facts.noise_variance;
  const double counts = image.format == PixelFormat::kMono8 ? image.row8(p.v)[p.u] : image.row16(p.v)[p.u];
  return config_.read_noise_counts * config_.read_noise_counts + config_.counts_per_electron * counts + 1.0 / 12;
}

void CornerDetector::report(const ImageView& image, const RowMask* missing, const Found& found, CornerSet& out) {
  const Peak& p = found.peak;
  const double pixel_variance = 1.0 / 12 + config_.pixel_sigma_px * config_.pixel_sigma_px;
  int u = p.u, v = p.v, reach = config_.gaussian_size / 2 + 1;
  Corner corner{Vec2(p.u, p.v), pixel_variance * Mat2::Identity(), p.measure, false};
  if (config_.subpixel_window_px > 0) {
    const Localised fine = refiner_.refine(image, p.u, p.v, noise_variance(image, facts_[found.box], p));
    if (fine.converged) {
      corner.uv_px = fine.uv_px;
      corner.cov_px2 = fine.cov_px2;
      corner.subpixel = true;
    }
    u = static_cast<int>(std::lround(corner.uv_px.x()));
    v = static_cast<int>(std::lround(corner.uv_px.y()));
    reach = refiner_.reach();
  }
  const Support around = support(image, missing, facts_[found.box], u, v, reach);
  if (around == Support::kUnreadable) return;
  clip(around, corner);
  out.items.push_back(corner);
}

}  // namespace cyclops
