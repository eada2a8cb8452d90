#pragma once
/// The camera's clock seen from the service clock: edge = a + b * tick, fitted to the last confirmed pairs.
///
/// Both stamps are of one physical event, the start of an exposure, so the residual is a few tens of microseconds and
/// no transport time enters. This class is the seam for a later clock model (PPS, temperature, holdover): whatever
/// answers `at` and `sigma_at` can stand here.
/// Time     ticks in ns of the camera clock, edges on the service clock. Only differences enter arithmetic.
/// Threads  one at a time. Memory: no heap.
#include <cstddef>
#include <cstdint>

#include "base/time.hpp"
#include "timesync/ring.hpp"

namespace cyclops {

class TickLine {
 public:
  explicit TickLine(double max_rate_ppm) : max_rate_(max_rate_ppm * 1e-6) {}
  void clear();         ///< forgets everything: another camera, or its clock restarted
  void clear_pairs();   ///< keeps the rate, which is a property of the two oscillators
  void add(std::int64_t tick_ns, Time edge);

  [[nodiscard]] bool valid() const { return !pairs_.empty(); }
  [[nodiscard]] Time at(std::int64_t tick_ns) const;               ///< needs valid()
  [[nodiscard]] Duration sigma_at(std::int64_t tick_ns) const;     ///< of the line alone; grows with distance from the last pair
  [[nodiscard]] Duration age_at(std::int64_t tick_ns) const { return {tick_ns - pairs_.back().tick_ns}; }
  [[nodiscard]] double rate_ppm() const { return rate_ * 1e6; }    ///< service clock against camera clock
  [[nodiscard]] double rms_ns() const { return rms_ns_; }
  [[nodiscard]] std::size_t pairs() const { return pairs_.size(); }

 private:
  struct Pair { std::int64_t tick_ns{0}; Time edge{}; };
  struct Fit { double offset_ns{0}, rate{0}, rms_ns{0}; std::size_t used{0}; };
  static constexpr std::size_t kPairs = 64;
  [[nodiscard]] Fit fit(double limit_ns, const Fit& before) const;
  void refit();

  double max_rate_;
  Ring<Pair, kPairs> pairs_;
  double offset_ns_{0};        // at the newest pair
  double rate_{0};
  double rate_sigma_{20e-6};   // two quartz oscillators before anything is known
  double rms_ns_{0};
};

}  // namespace cyclops
