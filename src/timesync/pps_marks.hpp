#pragma once
/// Edges of a PPS line to time marks: which second of GPS time began at this edge.
///
/// The edge is exact but has no number. A rough clock (arrival of TSPI, or another source of marks) numbers the first ones;
/// from then on seconds are counted from edge to edge, and the rough clock only checks. Five edges in a row where it puts
/// another second lead to a new numbering.
/// Threads  one at a time. No clock. Memory: in place.
#include <cstdint>
#include <optional>

#include "base/time.hpp"
#include "msg/strobe.hpp"

namespace cyclops {

struct PpsConfig {
  bool rising{true};                    ///< the edge at the beginning of the second
  Duration delay{};                     ///< edge later than the second by this
  Duration delay_sigma{20'000};         ///< 1 sigma of the mark: what is not known of it
  Duration interval_gate{1'000'000};    ///< an edge may be this far off a whole number of seconds after the last one ...
  double rate_ppm{600};                 ///< ... and this much more for each second between
  Duration rough_gate{300'000'000};     ///< a rough time further from a whole second than this numbers nothing
};

struct PpsCounters {
  std::uint64_t edges{0};
  std::uint64_t marks{0};
  std::uint64_t other{0};               ///< the other slope, or not later than the one before
  std::uint64_t spurious{0};            ///< off the grid of seconds
  std::uint64_t missed{0};              ///< seconds without an edge
  std::uint64_t unnumbered{0};          ///< nothing rough to number them by yet
  std::uint64_t disputed{0};            ///< the rough clock put another second
  std::uint64_t renumbered{0};
};

class PpsMarks {
 public:
  explicit PpsMarks(const PpsConfig& config) : config_(config) {}
  /// `rough` is the GPS time of the edge by the rough clock, late by some tens of milliseconds at most; none when there is no such clock.
  std::optional<TimeMark> on_edge(const StrobeEdge& edge, std::optional<GpsTime> rough);
  [[nodiscard]] const PpsCounters& counters() const { return counters_; }

 private:
  bool begin(const StrobeEdge& edge, std::optional<std::int64_t> rough_second);
  bool count_on(const StrobeEdge& edge, std::optional<std::int64_t> rough_second);
  [[nodiscard]] std::optional<std::int64_t> steps(Time t) const;

  PpsConfig config_;
  PpsCounters counters_;
  std::optional<Time> last_;            // last edge on the grid
  std::optional<std::int64_t> second_;  // its number
  int off_grid_{0}, disputed_{0};       // in a row
};

}  // namespace cyclops
