#include "timesync/pps_marks.hpp"

#include <cstdlib>

namespace cyclops {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr int kInARow = 5;

std::int64_t nearest_second(std::int64_t ns) { return (ns + kSecond_ns / 2) / kSecond_ns; }

}  // namespace

// Whole seconds since the last edge; none when there is no such number.
std::optional<std::int64_t> PpsMarks::steps(Time t) const {
  const std::int64_t since = (t - *last_).ns, n = nearest_second(since);
  const auto gate = config_.interval_gate.ns + static_cast<std::int64_t>(config_.rate_ppm * 1e3 * static_cast<double>(n));
  if (n < 1 || std::llabs(since - n * kSecond_ns) > gate) return std::nullopt;
  return n;
}

// An edge is numbered when the one before it lay one second earlier: a glitch stands alone.
bool PpsMarks::begin(const StrobeEdge& edge, std::optional<std::int64_t> rough_second) {
  const bool follows = last_ && steps(edge.t) == 1;
  last_ = edge.t;
  if (!follows || !rough_second) { ++counters_.unnumbered; return false; }
  second_ = rough_second;
  off_grid_ = disputed_ = 0;
  return true;
}

// False: off the grid of seconds. Several in a row: the grid itself has moved, and the numbers with it.
bool PpsMarks::count_on(const StrobeEdge& edge, std::optional<std::int64_t> rough_second) {
  const auto n = steps(edge.t);
  if (!n) {
    ++counters_.spurious;
    if (++off_grid_ < kInARow) return false;
    second_.reset();
    last_ = edge.t;
    return false;
  }
  counters_.missed += static_cast<std::uint64_t>(*n - 1);
  *second_ += *n;
  last_ = edge.t;
  off_grid_ = 0;
  const bool dispute = rough_second && *rough_second != *second_;
  disputed_ = dispute ? disputed_ + 1 : 0;
  if (dispute) ++counters_.disputed;
  if (disputed_ < kInARow) return true;
  second_ = rough_second;
  disputed_ = 0;
  ++counters_.renumbered;
  return true;
}

std::optional<TimeMark> PpsMarks::on_edge(const StrobeEdge& edge, std::optional<GpsTime> rough) {
  ++counters_.edges;
  if (edge.rising != config_.rising || (last_ && edge.t <= *last_)) { ++counters_.other; return std::nullopt; }
  std::optional<std::int64_t> rough_second;
  if (rough) {
    const std::int64_t at = rough->ns - config_.delay.ns, s = nearest_second(at);
    if (std::llabs(at - s * kSecond_ns) <= config_.rough_gate.ns) rough_second = s;
  }
  if (!(second_ ? count_on(edge, rough_second) : begin(edge, rough_second))) return std::nullopt;
  ++counters_.marks;
  return TimeMark{edge.t - config_.delay, GpsTime{*second_ * kSecond_ns}, config_.delay_sigma};
}

}  // namespace cyclops
