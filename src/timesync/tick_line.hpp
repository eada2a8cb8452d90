#pragma once
/// The camera's clock seen from the service clock, from confirmed pairs of tick and edge.
///
/// Both stamps are of one physical event, the start of an exposure, so the residual is a few tens of microseconds and
/// no transport time enters. Offset, rate and their growth without edges: timesync/clock_filter.hpp.
/// Time     ticks in ns of the camera clock, edges on the service clock. Only differences enter arithmetic.
/// Threads  one at a time. Memory: no heap.
#include <cstddef>
#include <cstdint>

#include "timesync/clock_filter.hpp"

namespace cyclops {

class TickLine {
 public:
  explicit TickLine(const ClockNoise& noise) : filter_(noise) {}
  void clear() { filter_.forget(); }                ///< another camera, or its clock restarted
  void clear_pairs() { filter_.forget_offset(); }   ///< keeps the rate, which is a property of the two oscillators
  void add(std::int64_t tick_ns, Time edge) { filter_.add(tick_ns, edge); }

  [[nodiscard]] bool valid() const { return filter_.valid(); }
  [[nodiscard]] Time at(std::int64_t tick_ns) const { return filter_.at(tick_ns); }                  ///< needs valid()
  [[nodiscard]] Duration sigma_at(std::int64_t tick_ns) const { return filter_.sigma_at(tick_ns); }  ///< of the line alone; grows with distance from the last pair
  [[nodiscard]] Duration age_at(std::int64_t tick_ns) const { return filter_.age_at(tick_ns); }
  [[nodiscard]] double rate_ppm() const { return filter_.rate() * 1e6; }             ///< service clock against camera clock
  [[nodiscard]] double rate_sigma_ppm() const { return filter_.rate_sigma() * 1e6; }
  [[nodiscard]] double rms_ns() const { return filter_.stamp_sigma_ns(); }           ///< scatter of edges about the line
  [[nodiscard]] std::uint64_t pairs() const { return filter_.pairs(); }

 private:
  ClockFilter filter_;
};

}  // namespace cyclops
