#include "flow/flow_finder.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace cyclops {
namespace {

constexpr double kAcross_cells = 80;    // the group, at most
constexpr double kSmaller = 0.75;       // a group this much smaller takes smaller cells
constexpr double kLeastInside = 0.4;    // share of a part inside the outline
constexpr float kLeastContrast = 1.5F;  // counts of 8 bits, rms of a part
constexpr std::size_t kLeastParts = 4;
constexpr double kSigma_cells = 0.25;   // 1 sigma of a place found, an axis, however sharp
constexpr double kBlunt = 0.25;         // variance of a place for what its correlation lacks of 1 over the curvature of its peak
constexpr double kLeastCurvature = 0.005;  // a cell squared

double cross(const Vec2& o, const Vec2& a, const Vec2& b) { return (a - o).x() * (b - o).y() - (a - o).y() * (b - o).x(); }

/// Mean of the pixels of one cell; rows that are missing do not count. Counts of 8 bits.
template <class T>
float cell_mean(const ImageView& image, const RowMask* missing, int u0, int v0, int side, float scale) {
  std::uint32_t sum = 0;
  int rows = 0;
  for (int v = v0; v < v0 + side; ++v) {
    if (missing != nullptr && missing->missing(v)) continue;
    const T* row = reinterpret_cast<const T*>(image.row8(v)) + u0;
    for (int u = 0; u < side; ++u) sum += row[u];
    ++rows;
  }
  return rows == 0 ? 0 : scale * static_cast<float>(sum) / static_cast<float>(rows * side);
}

float cell(const ImageView& image, const RowMask* missing, int u0, int v0, int side) {
  const float scale = 1.0F / static_cast<float>(1 << (bits_per_pixel(image.format) - 8));
  return bytes_per_pixel(image.format) == 1 ? cell_mean<std::uint8_t>(image, missing, u0, v0, side, scale)
                                            : cell_mean<std::uint16_t>(image, missing, u0, v0, side, scale);
}

}  // namespace

FlowFinder::FlowFinder(const FlowConfig& config) : config_(config) {
  if (config.enabled) field_.resize(kMost * kMost);
}

/// Convex hull, counter-clockwise with v up (Andrew's monotone chain).
void FlowFinder::outline() {
  hull_.clear();
  std::sort(points_.begin(), points_.end(), [](const Vec2& a, const Vec2& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  const auto add = [&](const Vec2& p, std::size_t from) {
    while (hull_.size() >= from + 2 && cross(hull_[hull_.size() - 2], hull_.back(), p) <= 0) hull_.pop_back();
    if (!hull_.full()) hull_.push_back(p);
  };
  for (const Vec2& p : points_) add(p, 0);
  const std::size_t lower = hull_.empty() ? 0 : hull_.size() - 1;
  for (std::size_t i = points_.size(); i-- > 0;) add(points_[i], lower);
  if (hull_.size() > 1) hull_.pop_back();
}

bool FlowFinder::in_outline(const Vec2& uv) const {
  for (std::size_t i = 0; i < hull_.size(); ++i)
    if (cross(hull_[i], hull_[(i + 1) % hull_.size()], uv) < 0) return false;
  return true;
}

bool FlowFinder::cut(const ImageView& image, const RowMask* missing, const Prediction& p, Part& part) const {
  const double side = cell_px_;
  const int u0 = static_cast<int>(std::lround(p.uv_px.x() - 0.5 * side * kSide + 0.5)), v0 = static_cast<int>(std::lround(p.uv_px.y() - 0.5 * side * kSide + 0.5));
  if (u0 < 0 || v0 < 0 || u0 + kSide * cell_px_ > image.width || v0 + kSide * cell_px_ > image.height) return false;
  const Vec2 middle(u0 + 0.5 * (side * kSide - 1), v0 + 0.5 * (side * kSide - 1));
  part.feature = p.feature;
  part.age = 0;
  part.inside_px = p.uv_px - middle;
  float sum = 0, count = 0;
  for (int v = 0; v < kSide; ++v)
    for (int u = 0; u < kSide; ++u) {
      const std::size_t i = static_cast<std::size_t>(v * kSide + u);
      part.inside[i] = in_outline(middle + side * Vec2(u - kHalf, v - kHalf)) ? 1 : 0;
      part.cell[i] = part.inside[i] > 0 ? cell(image, missing, u0 + u * cell_px_, v0 + v * cell_px_, cell_px_) : 0;
      sum += part.cell[i];
      count += part.inside[i];
    }
  if (count < kLeastInside * kSide * kSide) return false;
  float square = 0;
  for (std::size_t i = 0; i < part.cell.size(); ++i) {
    part.cell[i] -= part.inside[i] * sum / count;
    square += part.cell[i] * part.cell[i];
  }
  part.count = count;
  part.norm = std::sqrt(square);
  return square > count * kLeastContrast * kLeastContrast;
}

/// What is too old, or was not worth to be cut.
void FlowFinder::forget() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].age > kRemember) continue;
    if (kept != i) parts_[kept] = parts_[i];
    ++kept;
  }
  parts_.resize(kept);
}

/// Its own, a new one, or the oldest; those of this frame stay.
FlowFinder::Part* FlowFinder::part_of(std::uint16_t feature) {
  for (Part& part : parts_)
    if (part.feature == feature) return &part;
  if (!parts_.full()) {
    parts_.resize(parts_.size() + 1);
    parts_.back().feature = feature;
    parts_.back().age = kRemember + 1;
    return &parts_.back();
  }
  Part* const oldest = std::max_element(parts_.begin(), parts_.end(), [](const Part& a, const Part& b) { return a.age < b.age; });
  return oldest->age > 0 ? oldest : nullptr;
}

void FlowFinder::learn(const ImageView& image, const RowMask* missing, const PredictionSet& aligned, const MeasurementSet& measured) {
  if (!config_.enabled || image.data == nullptr) return;
  seen_.clear();
  points_.clear();
  for (const Measurement& m : measured.items)
    if (m.accepted) {
      seen_.push_back(m.feature);
      points_.push_back(aligned.items[m.feature].uv_px);
    }
  forget();
  if (points_.size() < kLeastParts) return;
  outline();
  Vec2 low = points_[0], high = points_[0];
  for (const Vec2& p : points_) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  for (Part& part : parts_) ++part.age;
  const double across = (high - low).maxCoeff() / kAcross_cells;
  if (across > cell_px_ || across < kSmaller * cell_px_ - 1) {
    cell_px_ = std::clamp(static_cast<int>(std::ceil(across)), 1, 16);
    parts_.clear();
  }
  const std::size_t step = 1 + (seen_.size() - 1) / kParts;
  for (std::size_t i = 0; i < seen_.size(); i += step) {
    Part* part = part_of(seen_[i]);
    if (part == nullptr) break;
    if (cut(image, missing, aligned.items[seen_[i]], fresh_)) *part = fresh_;
  }
  forget();
}

/// The cells in which the parts may be; each part's middle among them.
bool FlowFinder::read_field(const ImageView& image, const RowMask* missing, const PredictionSet& expected) {
  const double side = cell_px_;
  Vec2 low(1e9, 1e9), high(-1e9, -1e9);
  std::size_t sought = 0;
  for (Part& part : parts_) {
    const Prediction& at = expected.items[part.feature];
    part.sought = at.visibility == Visibility::kVisible;
    if (!part.sought) continue;
    ++sought;
    low = low.cwiseMin(at.uv_px);
    high = high.cwiseMax(at.uv_px);
  }
  if (sought < kLeastParts) return false;
  const double margin = side * (kReach + kHalf + 1);
  const auto first = [&](double at) { return std::max(0, static_cast<int>(std::floor(at - margin))); };
  const auto last = [&](double at, int size) { return std::min(size, static_cast<int>(std::ceil(at + margin))); };
  field_u0_ = first(low.x());
  field_v0_ = first(low.y());
  field_width_ = std::min(kMost, (last(high.x(), image.width) - field_u0_) / cell_px_);
  field_height_ = std::min(kMost, (last(high.y(), image.height) - field_v0_) / cell_px_);
  if (field_width_ < kSide || field_height_ < kSide) return false;
  for (int v = 0; v < field_height_; ++v)
    for (int u = 0; u < field_width_; ++u)
      field_[static_cast<std::size_t>(v * kMost + u)] = cell(image, missing, field_u0_ + u * cell_px_, field_v0_ + v * cell_px_, cell_px_);
  for (Part& part : parts_) {
    if (!part.sought) continue;
    const Vec2 middle = middle_cell(part, expected.items[part.feature]);
    part.u = static_cast<int>(std::lround(middle.x()));
    part.v = static_cast<int>(std::lround(middle.y()));
  }
  return true;
}

/// Of the part with its feature there, in cells of the field.
Vec2 FlowFinder::middle_cell(const Part& part, const Prediction& expected) const {
  const double side = cell_px_;
  return (expected.uv_px - part.inside_px - Vec2(field_u0_, field_v0_) - 0.5 * (side - 1) * Vec2::Ones()) / side;
}

/// Where a shift leaves the field nothing is known: correlation 0.
void FlowFinder::correlate(Part& part) const {
  const int first_u = std::max(-kReach, kHalf - part.u), last_u = std::min(kReach, field_width_ - 1 - kHalf - part.u);
  part.map.fill(0);
  if (last_u < first_u) return;
  const int n = last_u - first_u + 1;
  for (int dv = -kReach; dv <= kReach; ++dv) {
    const int top = part.v + dv - kHalf;
    if (top < 0 || top + kSide > field_height_) continue;
    std::array<float, kShifts> sum{}, square{}, product{};
    for (int v = 0; v < kSide; ++v)
      for (int u = 0; u < kSide; ++u) {
        const std::size_t i = static_cast<std::size_t>(v * kSide + u);
        if (part.inside[i] == 0) continue;
        const float t = part.cell[i];
        const float* x = field_.data() + (top + v) * kMost + part.u + first_u - kHalf + u;
        for (int k = 0; k < n; ++k) {
          sum[static_cast<std::size_t>(k)] += x[k];
          square[static_cast<std::size_t>(k)] += x[k] * x[k];
          product[static_cast<std::size_t>(k)] += t * x[k];
        }
      }
    float* out = part.map.data() + (dv + kReach) * kShifts + first_u + kReach;
    for (int k = 0; k < n; ++k) {
      const std::size_t i = static_cast<std::size_t>(k);
      const float spread = square[i] - sum[i] * sum[i] / part.count;
      out[k] = spread > part.count * kLeastContrast * kLeastContrast ? product[i] / (part.norm * std::sqrt(spread)) : 0;
    }
  }
}

/// The best within kGive cells, one axis after the other.
void FlowFinder::widen(const Map& map, Map& out) {
  const auto best = [](const Map& from, int at, int step, int place) {
    float most = -1;
    for (int d = std::max(-kGive, -place); d <= std::min(kGive, kShifts - 1 - place); ++d) most = std::max(most, from[static_cast<std::size_t>(at + d * step)]);
    return most;
  };
  Map across;
  for (int v = 0; v < kShifts; ++v)
    for (int u = 0; u < kShifts; ++u) across[static_cast<std::size_t>(v * kShifts + u)] = best(map, v * kShifts + u, 1, u);
  for (int v = 0; v < kShifts; ++v)
    for (int u = 0; u < kShifts; ++u) out[static_cast<std::size_t>(v * kShifts + u)] = best(across, v * kShifts + u, kShifts, v);
}

/// The shift, as an index from 0, that suits most parts.
bool FlowFinder::group(int& u, int& v) {
  constexpr float kOwn = 0.1F;  // of the map that gives nothing: the middle of the plateau
  sum_.fill(0);
  double n = 0;
  for (const Part& part : parts_) {
    if (!part.sought) continue;
    ++n;
    widen(part.map, wide_);
    for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] += wide_[i] + kOwn * part.map[i];
  }
  const std::size_t best = static_cast<std::size_t>(std::max_element(sum_.begin(), sum_.end()) - sum_.begin());
  u = static_cast<int>(best) % kShifts;
  v = static_cast<int>(best) / kShifts;
  float second = 0;
  for (int y = 0; y < kShifts; ++y)
    for (int x = 0; x < kShifts; ++x)
      if (std::max(std::abs(x - u), std::abs(y - v)) > 2 * kGive) second = std::max(second, sum_[static_cast<std::size_t>(y * kShifts + x)]);
  return sum_[best] > n * config_.least_correlation && sum_[best] - second > n * config_.least_margin;
}

/// The part's own peak near shift u, v.
void FlowFinder::place(const Part& part, int u, int v) {
  const auto at = [&](int x, int y) { return part.map[static_cast<std::size_t>(y * kShifts + x)]; };
  int best_u = -1, best_v = -1;
  float best = static_cast<float>(config_.least_correlation);
  for (int y = std::max(1, v - kGive); y <= std::min(kShifts - 2, v + kGive); ++y)
    for (int x = std::max(1, u - kGive); x <= std::min(kShifts - 2, u + kGive); ++x)
      if (at(x, y) > best) {
        best = at(x, y);
        best_u = x;
        best_v = y;
      }
  if (best_u < 0) return;
  const auto between = [](float a, float b, float c) { return a - 2 * b + c < 0 ? std::clamp(0.5 * (a - c) / (a - 2 * b + c), -0.5, 0.5) : 0.0; };
  const Vec2 part_of_cell(between(at(best_u - 1, best_v), best, at(best_u + 1, best_v)), between(at(best_u, best_v - 1), best, at(best_u, best_v + 1)));
  const double side = cell_px_;
  const Vec2 middle = Vec2(part.u + best_u - kReach, part.v + best_v - kReach) + part_of_cell;
  Landmark mark;
  mark.feature = part.feature;
  mark.uv_px = Vec2(field_u0_, field_v0_) + side * middle + 0.5 * (side - 1) * Vec2::Ones() + part.inside_px;
  Mat2 curvature;
  const double twist = 0.25 * (at(best_u + 1, best_v + 1) + at(best_u - 1, best_v - 1) - at(best_u + 1, best_v - 1) - at(best_u - 1, best_v + 1));
  curvature << 2 * best - at(best_u - 1, best_v) - at(best_u + 1, best_v), -twist, -twist, 2 * best - at(best_u, best_v - 1) - at(best_u, best_v + 1);
  Eigen::SelfAdjointEigenSolver<Mat2> sharp;
  sharp.computeDirect(curvature);
  const Vec2 variance = kBlunt * std::max(0.02, 1.0 - best) * sharp.eigenvalues().cwiseMax(kLeastCurvature).cwiseInverse() + kSigma_cells * kSigma_cells * Vec2::Ones();
  mark.cov_px2 = side * side * sharp.eigenvectors() * variance.asDiagonal() * sharp.eigenvectors().transpose();
  found_.push_back(mark);
}

const LandmarkSet& FlowFinder::find(const ImageView& image, const RowMask* missing, const PredictionSet& expected) {
  found_.clear();
  if (!config_.enabled || image.data == nullptr || parts_.size() < kLeastParts || !read_field(image, missing, expected)) return found_;
  for (Part& part : parts_)
    if (part.sought) correlate(part);
  int u = 0, v = 0;
  if (!group(u, v)) return found_;
  for (const Part& part : parts_)
    if (part.sought) place(part, u, v);
  return enough();
}

const LandmarkSet& FlowFinder::find_again(const PredictionSet& expected) {
  found_.clear();
  for (const Part& part : parts_) {
    if (!part.sought || expected.items[part.feature].visibility != Visibility::kVisible) continue;
    const Vec2 middle = middle_cell(part, expected.items[part.feature]);
    place(part, static_cast<int>(std::lround(middle.x())) - part.u + kReach, static_cast<int>(std::lround(middle.y())) - part.v + kReach);
  }
  return enough();
}

const LandmarkSet& FlowFinder::enough() {
  if (found_.size() < std::max(kLeastParts, parts_.size() / 2)) found_.clear();
  return found_;
}

}  // namespace cyclops
