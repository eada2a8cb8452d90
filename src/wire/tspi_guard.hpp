#pragma once
/// What is wrong with a stream of TSPI reports that are good one by one. One guard an aircraft.
///
/// Refused   reports of the other aircraft; more reports than max_rate_hz (bucket of one second, on arrival times); a
///           frozen state: the same to the last bit while its time goes on and its speed is above 1 m/s.
/// Counted   degraded reports, times and numbers that repeat, go back or skip. Order itself is the buffer's business
///           (nav/tspi_buffer.hpp), so late reports pass.
/// Time base arrival: service clock. Threads: one at a time. No heap.
#include <cstdint>

#include "base/time.hpp"
#include "msg/tspi.hpp"

namespace cyclops {

struct TspiGuardConfig {
  double max_rate_hz{400};
  int frozen_after{5};      ///< so many identical states in a row are believed
};

enum class TspiVerdict : std::uint8_t { kPass, kWrongAircraft, kTooMany, kFrozen };
/// Short and constant, for events and counters: "frozen".
[[nodiscard]] const char* to_string(TspiVerdict verdict);

struct TspiGuardCounters {
  std::uint64_t passed{0};
  std::uint64_t wrong_aircraft{0};
  std::uint64_t too_many{0};
  std::uint64_t frozen{0};
  std::uint64_t degraded{0};
  std::uint64_t time_back{0};
  std::uint64_t time_repeated{0};
  std::uint64_t seq_skipped{0};
  std::uint64_t seq_back{0};   ///< or repeated
};

class TspiGuard {
 public:
  explicit TspiGuard(Aircraft aircraft, const TspiGuardConfig& config = {}) : aircraft_(aircraft), config_(config) {}
  TspiVerdict check(const TspiReport& report, Time arrival);
  [[nodiscard]] const TspiGuardCounters& counters() const { return counters_; }

 private:
  bool within_rate(Time arrival);
  bool frozen(const TspiReport& report);
  void count(const TspiReport& report);

  Aircraft aircraft_;
  TspiGuardConfig config_;
  TspiGuardCounters counters_{};
  bool any_{false};
  TspiReport last_{};
  int repeats_{0};
  bool filled_{false};
  Time t_filled_{};
  std::int64_t credit_ns_{0};
};

}  // namespace cyclops
