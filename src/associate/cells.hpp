#pragma once
/// The corners of one frame, sorted into square cells, so that a gate looks at its neighbourhood and not at all of them.
///
/// Cells are kept in a hash table of their coordinates: no image size is assumed, and a frame with few corners costs little.
/// Threads  one object a thread. Memory: all of it in the constructor.
#include <cmath>
#include <cstdint>
#include <vector>

#include "msg/chain.hpp"

namespace cyclops {

class CornerCells {
 public:
  explicit CornerCells(std::size_t max_corners);
  /// `side_px`: edge of a cell; as large as the largest gate radius is best. Corners that are not finite are left out.
  void build(const CornerSet& corners, double side_px);

  /// Calls each(corner index, u, v) for every corner in a cell that the square p +- radius touches, perhaps more than the
  /// gate but never less. Order: cells row by row, corners by index within a cell.
  template <class Each>
  void near(const Vec2& p, double radius_px, Each&& each) const {
    const std::int32_t u0 = cell(p.x() - radius_px), u1 = cell(p.x() + radius_px);
    const std::int32_t v0 = cell(p.y() - radius_px), v1 = cell(p.y() + radius_px);
    for (std::int32_t cv = v0; cv <= v1; ++cv)
      for (std::int32_t cu = u0; cu <= u1; ++cu) {
        const std::uint32_t b = bucket(cu, cv);
        for (std::uint32_t k = first_[b]; k < first_[b + 1]; ++k)
          if (entries_[k].cu == cu && entries_[k].cv == cv) each(entries_[k].corner, entries_[k].u, entries_[k].v);
      }
  }

 private:
  struct Entry {
    double u, v;
    std::int32_t cu, cv, corner;
  };
  [[nodiscard]] std::int32_t cell(double x) const {
    return static_cast<std::int32_t>(std::floor((x < -kFar ? -kFar : x > kFar ? kFar : x) * per_px_));
  }
  [[nodiscard]] std::uint32_t bucket(std::int32_t cu, std::int32_t cv) const {
    return (static_cast<std::uint32_t>(cu) * 73856093U ^ static_cast<std::uint32_t>(cv) * 19349663U) & mask_;
  }
  static constexpr double kFar = 1e6;  ///< px; keeps cell numbers within 32 bits
  double per_px_{1};
  std::uint32_t mask_{0};
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> bucket_of_;
  std::vector<Entry> entries_;
};

}  // namespace cyclops
