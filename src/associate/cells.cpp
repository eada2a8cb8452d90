#include "associate/cells.hpp"

#include <algorithm>
#include <bit>

namespace cyclops {
namespace {

constexpr std::uint32_t kNowhere = 0xffffffffU;
constexpr std::size_t kFewestBuckets = 64;

}  // namespace

CornerCells::CornerCells(std::size_t max_corners) {
  first_.resize(std::max(kFewestBuckets, std::bit_ceil(max_corners)) + 2);
  bucket_of_.resize(max_corners);
  entries_.resize(max_corners);
}

/// A counting sort by bucket: count, sum up, place.
void CornerCells::build(const CornerSet& corners, double side_px) {
  CYCLOPS_ASSERT(side_px >= 1 && corners.items.size() <= entries_.size());
  const std::size_t n = corners.items.size();
  const std::size_t buckets = std::max(kFewestBuckets, std::bit_ceil(n));
  per_px_ = 1 / side_px;
  mask_ = static_cast<std::uint32_t>(buckets - 1);
  std::fill_n(first_.begin(), buckets + 2, 0U);
  const Corner* all = corners.items.begin();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2& p = all[i].uv_px;
    bucket_of_[i] = p.allFinite() ? bucket(cell(p.x()), cell(p.y())) : kNowhere;
    if (bucket_of_[i] != kNowhere) ++first_[bucket_of_[i] + 2];
  }
  for (std::size_t b = 2; b < buckets + 2; ++b) first_[b] += first_[b - 1];
  for (std::size_t i = 0; i < n; ++i) {
    if (bucket_of_[i] == kNowhere) continue;
    const Vec2& p = all[i].uv_px;
    entries_[first_[bucket_of_[i] + 1]++] = {p.x(), p.y(), cell(p.x()), cell(p.y()), static_cast<std::int32_t>(i)};
  }
}

}  // namespace cyclops
