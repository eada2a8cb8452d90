#pragma once
/// Which limits are exceeded, with onset hold time and hysteresis. Time is stepped by the caller.
///
/// On       the quantity has been beyond its limit for `hold`, in every step meanwhile.
/// Off      it has been within `clear` for `clear_hold`. An unknown quantity (NaN) is within.
/// Threads  one at a time. Memory: no heap in step() beyond the text of the alarms.
#include <functional>
#include <vector>

#include <cyclops/alarm_t.hpp>

#include "monitor/limits.hpp"

namespace cyclops {

struct AlarmChange {
  const Limit* limit{nullptr};
  bool on{false};
  double value{0};
  Time since{};                     ///< when the quantity passed the limit, or came back within `clear`
};

class Alarms {
 public:
  explicit Alarms(Limits limits);
  /// `h` as it would be sent now. The changes live until the next step.
  const std::vector<AlarmChange>& step(const health_t& h, Time now);
  /// Those that are on, faults first, in the order of the file, with the values of the last step; into HEALTH.
  void put(health_t& out) const;
  [[nodiscard]] const Limits& limits() const { return limits_; }

 private:
  struct State {
    bool on{false};
    bool turning{false};            // beyond while off, or back while on
    Time turned{};
    Time since{};                   // when an alarm that is on began
    double value{0};
  };
  Limits limits_;
  std::vector<State> states_;
  std::vector<AlarmChange> changes_;
};

/// "camera is silent: frame_age_ms 245 ms, limit 150 ms".
[[nodiscard]] std::string words(const Limit& limit, double value);

}  // namespace cyclops
