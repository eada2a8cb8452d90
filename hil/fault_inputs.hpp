#pragma once
/// Faults of everything that is not the camera's picture: strobe, clocks, time marks, TSPI.
///
/// Threads  one at a time.
#include <optional>
#include <vector>

#include <cyclops/time_mark_t.hpp>
#include <cyclops/tspi_t.hpp>

#include "hil/fault_player.hpp"
#include "msg/strobe.hpp"

namespace cyclops::hil {

template <class T>
struct Delayed {
  T item{};
  Duration later{};  ///< than it would have been sent
};

class InputFaults {
 public:
  explicit InputFaults(FaultPlayer& player) : player_(player) {}
  /// What comes out of the line for one edge that the camera made; none, one or more, in order of time.
  void strobe(const StrobeEdge& edge, std::vector<Delayed<StrobeEdge>>& out);
  /// What comes out of the link for one message.
  void tspi(Aircraft aircraft, const tspi_t& message, std::vector<Delayed<tspi_t>>& out);
  /// Nothing: lost.
  [[nodiscard]] std::optional<time_mark_t> mark(const time_mark_t& message);
  /// The camera's clock as its frames carry it.
  [[nodiscard]] std::int64_t camera_tick(std::int64_t tick_ns);

 private:
  void line(const StrobeEdge& edge, std::vector<Delayed<StrobeEdge>>& out);
  void spurious(const StrobeEdge& edge, std::vector<Delayed<StrobeEdge>>& out);
  void corrupt(Aircraft aircraft, tspi_t& message);
  FaultPlayer& player_;
  std::int64_t extra_edges_{0};          // on the line so far: its numbers move by as much
  Time last_edge_{};
  std::optional<tspi_t> frozen_[2];
};

}  // namespace cyclops::hil
