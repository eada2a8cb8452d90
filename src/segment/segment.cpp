#include "segment/segment.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace cyclops {
namespace {

constexpr std::uint64_t key_of(std::uint64_t row, std::uint64_t column) { return row << 32 | column; }

bool inside(const Vec2& p, int width, int height) {
  return p.x() >= -0.5 && p.y() >= -0.5 && p.x() < width - 0.5 && p.y() < height - 0.5;  // false for NaN
}

/// Distance between two axis-parallel rectangles, squared; 0 when they touch.
double gap2(const Vec2& low_a, const Vec2& high_a, const Vec2& low_b, const Vec2& high_b) {
  return (low_a - high_b).cwiseMax(low_b - high_a).cwiseMax(0.0).squaredNorm();
}

bool share_a_pixel(const SubImage& a, const SubImage& b) {
  return a.u0 < b.u0 + b.width && b.u0 < a.u0 + a.width && a.v0 < b.v0 + b.height && b.v0 < a.v0 + a.height;
}

void grow(SubImage& a, const SubImage& b) {
  const int u1 = std::max(a.u0 + a.width, b.u0 + b.width), v1 = std::max(a.v0 + a.height, b.v0 + b.height);
  a.u0 = std::min(a.u0, b.u0);
  a.v0 = std::min(a.v0, b.v0);
  a.width = u1 - a.u0;
  a.height = v1 - a.v0;
  a.features += b.features;
}

void sort_by_place(SubImageSet& boxes) {
  const auto before = [](const SubImage& a, const SubImage& b) { return a.v0 != b.v0 ? a.v0 < b.v0 : a.u0 < b.u0; };
  if (!std::is_sorted(boxes.begin(), boxes.end(), before)) std::sort(boxes.begin(), boxes.end(), before);
}

/// One sweep down the rows of boxes in order of v0, which stays; true when something was merged. A box that was taken in is
/// marked by features = 0.
bool merge_once(SubImageSet& boxes) {
  bool merged = false;
  for (SubImage* a = boxes.begin(); a != boxes.end(); ++a) {
    if (a->features == 0) continue;
    for (SubImage* b = a + 1; b != boxes.end() && b->v0 < a->v0 + a->height; ++b) {
      if (b->features == 0 || !share_a_pixel(*a, *b)) continue;
      grow(*a, *b);
      b->features = 0;
      merged = true;
    }
  }
  const auto gone = std::remove_if(boxes.begin(), boxes.end(), [](const SubImage& b) { return b.features == 0; });
  boxes.resize(static_cast<std::size_t>(gone - boxes.begin()));
  return merged;
}

}  // namespace

Result<SegmentConfig> SegmentConfig::read(ConfigTable& table, SegmentConfig c) {
  table.read_in("buffer_px", 0, kMaxImageSide, c.buffer_px);
  c.link_px = 2 * c.buffer_px + 1;
  table.read_in("link_px", 1.0, 2.0 * kMaxImageSide, c.link_px);
  table.read("merge_overlapping", c.merge_overlapping);
  return c;
}

Result<> check_buffer(const SegmentConfig& config, double gate_px, int border_px, int nms_radius_px) {
  const double least = gate_px + border_px + nms_radius_px + 1;
  if (config.buffer_px >= least) return Ok{};
  return make_error(ErrorCode::kInvalid, "segment.buffer_px",
                    "is " + std::to_string(config.buffer_px) + ", expected at least gate + border + NMS radius + 1 = " +
                        std::to_string(static_cast<int>(std::ceil(least))));
}

void Segmenter::segment(std::span<const Vec2> points_px, int width, int height, SubImageSet& out, int reach_px) {
  CYCLOPS_ASSERT(points_px.size() <= kMaxFeatures && reach_px >= 0);
  buffer_ = config_.buffer_px + reach_px;
  link_ = config_.link_px + 2 * reach_px;
  sort_into_cells(points_px, width, height);
  for (std::uint32_t c = 0; c < cells_; ++c) link_neighbours(c);
  boxes_of_clusters(width, height, out);
  sort_by_place(out);
  while (config_.merge_overlapping && merge_once(out)) {
  }
  sort_by_place(out);
}

/// Cells are squares whose diagonal is just below the threshold: points of one cell always belong together.
void Segmenter::sort_into_cells(std::span<const Vec2> points_px, int width, int height) {
  const double per_px = 1 / (link_ * (1 - 1e-9) * std::sqrt(0.5));
  points_ = 0;
  for (std::uint32_t i = 0; i < points_px.size(); ++i) {
    const Vec2& p = points_px[i];
    if (!inside(p, width, height)) continue;
    const auto row = static_cast<std::uint64_t>((p.y() + 0.5) * per_px), column = static_cast<std::uint64_t>((p.x() + 0.5) * per_px);
    keys_[points_++] = {key_of(row + 2, column + 2), i};  // + 2: neighbours never wrap below zero
  }
  std::sort(keys_.begin(), keys_.begin() + points_, [](const Keyed& a, const Keyed& b) { return a.cell < b.cell; });
  cells_ = 0;
  for (std::uint32_t i = 0; i < points_; ++i) {
    const Vec2& p = sorted_[i] = points_px[keys_[i].point];
    if (cells_ == 0 || cell_[cells_ - 1].key != keys_[i].cell) {
      const auto self = static_cast<std::uint32_t>(cells_);
      cell_[cells_++] = {keys_[i].cell, i, i, self, p, p};
    }
    Cell& c = cell_[cells_ - 1];
    c.end = i + 1;
    c.low = c.low.cwiseMin(p);
    c.high = c.high.cwiseMax(p);
  }
}

/// Points closer than the threshold are at most two cells apart; only cells that come later in the order are asked.
void Segmenter::link_neighbours(std::uint32_t cell) {
  const std::uint64_t key = cell_[cell].key;
  for (std::uint64_t row = 0; row <= 2; ++row) {
    const std::uint64_t first = key + (row << 32) - 2, last = first + 4;
    const auto end = cell_.begin() + cells_;
    auto it = std::lower_bound(cell_.begin() + cell, end, first, [](const Cell& c, std::uint64_t k) { return c.key < k; });
    for (; it != end && it->key <= last; ++it) {
      const auto other = static_cast<std::uint32_t>(it - cell_.begin());
      if (other > cell && root(cell) != root(other) && closer_than_link(cell_[cell], *it)) link(cell, other);
    }
  }
}

bool Segmenter::closer_than_link(const Cell& a, const Cell& b) const {
  const double limit = link_ * link_;
  if (gap2(a.low, a.high, b.low, b.high) >= limit) return false;
  for (std::uint32_t i = a.begin; i < a.end; ++i) {
    if (gap2(sorted_[i], sorted_[i], b.low, b.high) >= limit) continue;
    for (std::uint32_t j = b.begin; j < b.end; ++j)
      if ((sorted_[i] - sorted_[j]).squaredNorm() < limit) return true;
  }
  return false;
}

std::uint32_t Segmenter::root(std::uint32_t cell) const {
  while (cell_[cell].parent != cell) cell = cell_[cell].parent;
  return cell;
}

/// The earlier root wins, so a path never gets longer than the number of cells a cluster spans.
void Segmenter::link(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t ra = root(a), rb = root(b);
  cell_[std::max(ra, rb)].parent = std::min(ra, rb);
  cell_[b].parent = std::min(ra, rb);
}

void Segmenter::boxes_of_clusters(int width, int height, SubImageSet& out) {
  for (std::uint32_t c = 0; c < cells_; ++c) {  // a root comes before its members
    Cell& r = cell_[root(c)];
    r.low = r.low.cwiseMin(cell_[c].low);
    r.high = r.high.cwiseMax(cell_[c].high);
    if (&r != &cell_[c]) r.end += cell_[c].end - cell_[c].begin;
  }
  out.clear();
  for (std::uint32_t c = 0; c < cells_; ++c) {
    const Cell& r = cell_[c];
    if (r.parent != c) continue;
    const auto first = [&](double x) { return std::max(static_cast<int>(std::floor(x)) - buffer_, 0); };
    const auto last = [&](double x, int n) { return std::min(static_cast<int>(std::ceil(x)) + buffer_, n - 1); };
    const int u0 = first(r.low.x()), v0 = first(r.low.y());
    out.push_back({u0, v0, last(r.high.x(), width) - u0 + 1, last(r.high.y(), height) - v0 + 1, static_cast<int>(r.end - r.begin)});
  }
}

}  // namespace cyclops
