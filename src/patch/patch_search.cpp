#include "patch/patch_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/ellipse.hpp"

namespace cyclops {
namespace {

constexpr int kRefine = 6;
constexpr double kMostMove_px = 1.5;      // of a refinement, in the direction that the patch tells best
constexpr double kLeastSigma_px = 0.3;    // of the expected place
constexpr double kStep_px = 4;           // a step across the line of sight
constexpr double kLeastContrast = 2.0;  // counts, rms of a patch

template <class T>
void copy(const ImageView& image, int u0, int v0, int side, float* out) {
  for (int v = 0; v < side; ++v) {
    const T* row = reinterpret_cast<const T*>(image.row8(v0 + v)) + u0;
    for (int u = 0; u < side; ++u) out[v * side + u] = static_cast<float>(row[u]);
  }
}

/// A square of whole pixels as floats; false when it is not all there.
bool read_square(const ImageView& image, const RowMask* missing, int u0, int v0, int side, float* out) {
  if (u0 < 0 || v0 < 0 || u0 + side > image.width || v0 + side > image.height) return false;
  for (int v = v0; missing != nullptr && v < v0 + side; ++v)
    if (missing->missing(v)) return false;
  if (bytes_per_pixel(image.format) == 1) copy<std::uint8_t>(image, u0, v0, side, out);
  else copy<std::uint16_t>(image, u0, v0, side, out);
  return true;
}

float between(const float* image, int side, double u, double v) {
  const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
  const auto fu = static_cast<float>(u - u0), fv = static_cast<float>(v - v0);
  const float *a = image + v0 * side + u0, *b = a + side;
  const float top = a[0] + fu * (a[1] - a[0]), low = b[0] + fu * (b[1] - b[0]);
  return top + fv * (low - top);
}

/// To the right and down across a line of sight.
std::pair<Vec3, Vec3> across(const Vec3& p_c) {
  const Vec3 ray = p_c.normalized();
  const Vec3 right = (Vec3::UnitX() - ray.x() * ray).normalized();
  return {right, ray.cross(right)};
}

}  // namespace

PatchSearch::PatchSearch(const PatchConfig& config, const Camera& camera) : config_(config), camera_(camera), side_(2 * config.half_px + 1) {
  sum_.resize((kField + 1) * (kField + 1));
  sum2_.resize((kField + 1) * (kField + 1));
}

bool PatchSearch::take(const ImageView& image, const RowMask* missing, const Pose<frame::C, frame::K>& T, const Point<frame::K>& p_k, const Vec2& uv, StoredPatch& patch) const {
  const int u = static_cast<int>(std::lround(uv.x())), v = static_cast<int>(std::lround(uv.y()));
  if (!read_square(image, missing, u - StoredPatch::kHalf, v - StoredPatch::kHalf, StoredPatch::kSide, patch.store.data())) return false;
  patch.inside_px = uv - Vec2(u, v);
  patch.T_c_k = T;
  const Vec3 p_c = (T * p_k).xyz;
  patch.step_m = kStep_px * p_c.z() / camera_.intrinsics().fx_px;
  patch.then_px.setZero();
  const auto [right, down] = across(p_c);
  const auto at = camera_.project(Point<frame::C>(p_c)), beside = camera_.project(Point<frame::C>(p_c + patch.step_m * right)),
             below = camera_.project(Point<frame::C>(p_c + patch.step_m * down));
  if (at && beside && below) patch.then_px << *beside - *at, *below - *at;
  return true;
}

/// The patch as the pose says it should look now: a small plane through the feature, facing the camera when it was taken.
bool PatchSearch::turn(const StoredPatch& patch, const Pose<frame::C, frame::K>& T, const Point<frame::K>& p_k) {
  const Vec3 p_c = (patch.T_c_k * p_k).xyz;
  const auto [right, down] = across(p_c);
  const Pose<frame::K, frame::C> back = patch.T_c_k.inverse();
  const auto seen = [&](const Vec3& aside) { return camera_.project(T * (back * Point<frame::C>(p_c + patch.step_m * aside))); };
  const auto at = camera_.project(T * p_k), beside = seen(right), below = seen(down);
  if (!at || !beside || !below) return false;
  Mat2 now;
  now << *beside - *at, *below - *at;
  if (!(std::fabs(now.determinant()) > 1e-6)) return false;
  const Mat2 A = A_ = patch.then_px * now.inverse();
  const int h = config_.half_px;
  double sum = 0, sum2 = 0;
  for (int v = -h; v <= h; ++v)
    for (int u = -h; u <= h; ++u) {
      const Vec2 q = A * Vec2(u, v) + patch.inside_px + Vec2(StoredPatch::kHalf, StoredPatch::kHalf);
      if (!(q.x() >= 0 && q.y() >= 0 && q.x() < StoredPatch::kSide - 1 && q.y() < StoredPatch::kSide - 1)) return false;
      const float x = between(patch.store.data(), StoredPatch::kSide, q.x(), q.y());
      warped_[static_cast<std::size_t>((v + h) * side_ + u + h)] = x;
      sum += x;
      sum2 += static_cast<double>(x) * x;
    }
  const double n = side_ * side_, mean = sum / n;
  for (int i = 0; i < side_ * side_; ++i) warped_[static_cast<std::size_t>(i)] -= static_cast<float>(mean);
  warped_norm_ = std::sqrt(std::max(0.0, sum2 - n * mean * mean));
  return warped_norm_ > kLeastContrast * std::sqrt(n);
}

/// The image around a place; `origin` is the pixel of its first element.
bool PatchSearch::read_field(const ImageView& image, const RowMask* missing, const Vec2& around, int search, Vec2& origin) {
  field_side_ = side_ + 2 * search + 2;
  const int u0 = static_cast<int>(std::floor(around.x())) - config_.half_px - search, v0 = static_cast<int>(std::floor(around.y())) - config_.half_px - search;
  origin = {u0, v0};
  return read_square(image, missing, u0, v0, field_side_, field_.data());
}

bool PatchSearch::match(const ImageView& image, const RowMask* missing, const Prediction& expected, double common_px, Found& out) {
  const double sigma = larger_sigma(expected.cov_px2 - common_px * common_px * Mat2::Identity());  // an error of every frame moves no patch
  const int search = std::min(kMostSearch, 1 + static_cast<int>(std::ceil(std::min(config_.search_most_px, std::max(1.0, config_.search_sigmas * sigma)))));
  Vec2 origin;
  if (!read_field(image, missing, expected.uv_px, search, origin)) return false;
  const Vec2 middle = origin + Vec2(config_.half_px, config_.half_px);
  Vec2 shift{0, 0};
  out.correlation = correlate(2 * search + 2, shift);
  if (out.correlation < config_.least_correlation) return false;
  if (!refine(expected.uv_px - middle, std::max(kLeastSigma_px, sigma), shift, out.cov_px2)) return false;
  out.uv_px = middle + shift;
  return (out.uv_px - expected.uv_px).norm() < search + 1;
}

/// The whole-pixel shift below `shifts` in u and v with the largest normalised cross-correlation, which is returned.
double PatchSearch::correlate(int shifts, Vec2& shift) {
  sum_fields();
  const int n = side_ * side_, stride = field_side_ + 1;
  double best = -1;
  for (int dv = 0; dv < shifts; ++dv) {
    std::array<float, 2 * kMostSearch + 2> cross{};
    for (int v = 0; v < side_; ++v)
      for (int u = 0; u < side_; ++u) {
        const float w = warped_[static_cast<std::size_t>(v * side_ + u)];
        const float* f = &field_[static_cast<std::size_t>((v + dv) * field_side_ + u)];
        for (int du = 0; du < shifts; ++du) cross[static_cast<std::size_t>(du)] += w * f[du];
      }
    for (int du = 0; du < shifts; ++du) {
      const auto box = [&](const std::vector<double>& sums) {
        const double* top = &sums[static_cast<std::size_t>(dv * stride + du)];
        const double* low = top + side_ * stride;
        return low[side_] - low[0] - top[side_] + top[0];
      };
      const double sum = box(sum_), norm = std::sqrt(std::max(1e-9, box(sum2_) - sum * sum / n));
      const double correlation = cross[static_cast<std::size_t>(du)] / (norm * warped_norm_);
      if (correlation <= best) continue;
      best = correlation;
      shift = {du, dv};
    }
  }
  return best;
}

/// Sums of the field and its squares over all rectangles that begin at its first element.
void PatchSearch::sum_fields() {
  const int stride = field_side_ + 1;
  std::fill_n(sum_.begin(), stride, 0.0);
  std::fill_n(sum2_.begin(), stride, 0.0);
  for (int v = 0; v < field_side_; ++v) {
    double row = 0, row2 = 0;
    sum_[static_cast<std::size_t>((v + 1) * stride)] = sum2_[static_cast<std::size_t>((v + 1) * stride)] = 0;
    for (int u = 0; u < field_side_; ++u) {
      const double x = field_[static_cast<std::size_t>(v * field_side_ + u)];
      row += x;
      row2 += x * x;
      const auto at = static_cast<std::size_t>((v + 1) * stride + u + 1);
      sum_[at] = sum_[at - static_cast<std::size_t>(stride)] + row;
      sum2_[at] = sum2_[at - static_cast<std::size_t>(stride)] + row2;
    }
  }
}

/// Shift between pixels: gain and mean of the brightness are free.
bool PatchSearch::refine(const Vec2& expected, double sigma_px, Vec2& shift, Mat2& cov) const {
  const Vec2 start = shift;
  for (int round = 0; round < kRefine; ++round) {
    if (!(shift.x() >= 1 && shift.y() >= 1 && shift.x() + side_ + 1 < field_side_ && shift.y() + side_ + 1 < field_side_)) return false;
    // Values and central differences of the field under the patch, projected off the two brightness parameters.
    double n = 0, i1 = 0, x1 = 0, y1 = 0, ii = 0, iw = 0, xw = 0, yw = 0, xx = 0, xy = 0, yy = 0, xi = 0, yi = 0;
    for (int v = 0; v < side_; ++v)
      for (int u = 0; u < side_; ++u) {
        const double fu = shift.x() + u, fv = shift.y() + v;
        const double i = between(field_.data(), field_side_, fu, fv), w = warped_[static_cast<std::size_t>(v * side_ + u)];
        const double x = 0.5 * (between(field_.data(), field_side_, fu + 1, fv) - between(field_.data(), field_side_, fu - 1, fv));
        const double y = 0.5 * (between(field_.data(), field_side_, fu, fv + 1) - between(field_.data(), field_side_, fu, fv - 1));
        n += 1;
        i1 += i, x1 += x, y1 += y, ii += i * i, iw += i * w;
        xw += x * w, yw += y * w, xx += x * x, xy += x * y, yy += y * y, xi += x * i, yi += y * i;
      }
    // Unknowns: shift of the image against the patch. Model: i + x dx + y dy = a + b w, with sum of w zero.
    const double ww = warped_norm_ * warped_norm_;
    Mat2 N;
    N << xx - x1 * x1 / n - xw * xw / ww, xy - x1 * y1 / n - xw * yw / ww, 0, yy - y1 * y1 / n - yw * yw / ww;
    N(1, 0) = N(0, 1);
    const Vec2 b(xi - x1 * i1 / n - xw * iw / ww, yi - y1 * i1 / n - yw * iw / ww);
    const double left = std::max(1.0 / 12, (ii - i1 * i1 / n - iw * iw / ww) / (n - 4));
    const double prior = 1 / (sigma_px * sigma_px);
    cov = (N / (2 * left) + prior * Mat2::Identity()).inverse();
    const Vec2 change = -cov * (b / (2 * left) + prior * (shift - expected));
    shift += change;
    const Vec2 moved = shift - start;
    if (!(moved.dot(N * moved) < kMostMove_px * kMostMove_px * N.trace())) return false;
    if (change.norm() < 0.01) return true;
  }
  return true;
}

}  // namespace cyclops
