#pragma once
/// HEALTH from the counters of all threads: levels of now, rates of the last second, alarms.
///
/// Threads  the publishing thread only.
#include <array>

#include <cyclops/clock_state_t.hpp>
#include <cyclops/health_t.hpp>

#include "monitor/alarms.hpp"
#include "service/counts.hpp"
#include "service/host_facts.hpp"
#include "service/pipeline_state.hpp"

namespace cyclops {

class HealthMaker {
 public:
  explicit HealthMaker(Pipeline::State& s);
  /// Looks at everything; alarms that came or went are posted as events. True: at least one did.
  bool look(std::int64_t now_ns);
  /// As of the last look, numbered.
  const health_t& message();
  /// CLOCK as of the last look.
  const clock_state_t& clock();

 private:
  /// Totals of one moment, for the rates.
  struct Totals {
    std::int64_t t_ns{0};
    std::uint64_t frames{0}, lost{0}, refused{0}, edges{0}, tspi[2]{}, consensus{0};
  };
  static constexpr std::int64_t kEvery_ns = 100'000'000;
  static constexpr std::size_t kKept = 11;           // one second and the one being compared

  void take_counts();
  void levels(std::int64_t now_ns);
  void rates(std::int64_t now_ns);
  void counters();
  [[nodiscard]] Totals totals(std::int64_t now_ns) const;
  [[nodiscard]] std::int8_t state() const;

  Pipeline::State& s_;
  Alarms alarms_;
  HostWatch host_;
  Counts n_{};
  std::array<Totals, kKept> past_{};
  std::size_t kept_{0};
  health_t out_{};
  clock_state_t clock_{};
};

}  // namespace cyclops
