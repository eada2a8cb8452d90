#include "capture/frame_numbers.hpp"

namespace cyclops {
namespace {

constexpr std::uint64_t kShortIds = 65535;

/// Steps from `from` to `to`; 0 when `to` does not follow.
std::uint64_t steps(std::uint64_t from, std::uint64_t to) {
  if (to > from) return to - from;
  return from <= kShortIds ? (to + kShortIds - from) % kShortIds : 0;
}

}  // namespace

FrameNumbers::Step FrameNumbers::next(std::uint64_t id) {
  if (last_id_ == 0) {
    last_id_ = id;
    unknown_ = 0;
    return {++last_seq_, 0, false};
  }
  const std::uint64_t n = steps(last_id_, id);
  if (n == 0 || n > kMaxGap) return {0, 0, true};
  last_id_ = id;
  // Frames without an id lie between the two ids; more of them than there is room for cannot be told apart.
  const std::uint64_t lost = n > unknown_ ? n - 1 - unknown_ : 0;
  unknown_ = 0;
  last_seq_ += lost + 1;
  return {last_seq_, lost, false};
}

FrameNumbers::Step FrameNumbers::next_unknown() {
  ++unknown_;
  return {++last_seq_, 0, false};
}

void FrameNumbers::new_stream() {
  last_id_ = 0;
  unknown_ = 0;
  if (last_seq_ != 0) ++last_seq_;
}

}  // namespace cyclops
