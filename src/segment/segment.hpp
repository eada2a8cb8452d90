#pragma once
/// Decides which parts of the image are searched: predicted points become few, disjoint boxes.
///
/// Single-linkage clusters under a Euclidean threshold (strictly closer), the bounding box of each cluster grown by a
/// buffer and clipped to the image; boxes that still share a pixel are merged until none do. The result does not depend
/// on the order of the points and is sorted by row, then column.
///
/// Frames   raw pixels; a point at (u, v) with B = buffer covers columns floor(u)-B .. ceil(u)+B, rows likewise.
/// Errors   points outside the image, or not finite, are left out; no point inside gives an empty set.
/// Threads  one at a time (scratch inside). Memory: no heap.
/// Cost     n log n for n points spread over the image; see test/bench.
/// Source   spec 2.3; buffer rule and merging spec 2.3 [A], errata E38.
#include <array>
#include <cstdint>
#include <span>

#include "base/config.hpp"
#include "base/result.hpp"
#include "geometry/frames.hpp"
#include "msg/chain.hpp"

namespace cyclops {

struct SegmentConfig {
  int buffer_px{30};             ///< added on each side of a cluster's bounding box
  double link_px{61};            ///< two points belong together when closer than this; 2 buffer + 1 by default
  bool merge_overlapping{true};  ///< off: single-linkage boxes as they are, which may overlap (thesis)
  /// Table "segment": buffer_px, link_px, merge_overlapping. link_px follows buffer_px when it is not given.
  [[nodiscard]] static Result<SegmentConfig> read(ConfigTable& table, SegmentConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const SegmentConfig&) const = default;
};

/// What lies around a feature must fit into the buffer, or a corner in its gate would fall into the dropped border:
/// buffer >= gate + border (5) + NMS radius + 1.
[[nodiscard]] Result<> check_buffer(const SegmentConfig& config, double gate_px, int border_px, int nms_radius_px);

class Segmenter {
 public:
  explicit Segmenter(const SegmentConfig& config) : config_(config) {}
  /// At most kMaxFeatures points. `reach_px` is added to the buffer, and twice to the link: how far a feature may be from
  /// its point in this frame.
  void segment(std::span<const Vec2> points_px, int width, int height, SubImageSet& out, int reach_px = 0);

 private:
  struct Keyed {
    std::uint64_t cell;  ///< row of the cell in the upper half, column in the lower
    std::uint32_t point;
  };
  struct Cell {
    std::uint64_t key;
    std::uint32_t begin, end;  ///< into sorted_
    std::uint32_t parent;      ///< union-find over cells
    Vec2 low, high;            ///< of its points
  };
  void sort_into_cells(std::span<const Vec2> points_px, int width, int height);
  void link_neighbours(std::uint32_t cell);
  void link(std::uint32_t a, std::uint32_t b);
  [[nodiscard]] bool closer_than_link(const Cell& a, const Cell& b) const;
  [[nodiscard]] std::uint32_t root(std::uint32_t cell) const;
  void boxes_of_clusters(int width, int height, SubImageSet& out);

  SegmentConfig config_;
  int buffer_{0};               ///< of the frame at hand
  double link_{0};
  std::size_t points_{0};
  std::size_t cells_{0};
  std::array<Keyed, kMaxFeatures> keys_{};
  std::array<Vec2, kMaxFeatures> sorted_{};
  std::array<Cell, kMaxFeatures> cell_{};
};

}  // namespace cyclops
