#pragma once
/// Where the two aircraft really are at any time, and what their navigation says.
///
/// Time     seconds from the start of the flight. Frames and units as in flight_messages.hpp.
/// Threads  const use from any. Repeatable: a function of scenario and seed.
#include <array>
#include <vector>

#include "hil/flight_messages.hpp"
#include "hil/scenario.hpp"

namespace cyclops::hil {

class Motion {
 public:
  Motion(const Scenario& scenario, std::uint64_t seed);
  [[nodiscard]] AircraftState tanker(double t_s) const;
  [[nodiscard]] AircraftState receiver(double t_s) const;

 private:
  struct Wave { double rate_rps[2], phase[2], weight[2]; };
  [[nodiscard]] double wander(int channel, double t_s) const;  ///< -1..1, smooth
  [[nodiscard]] AircraftState place(bool tanker, double t_s) const;
  [[nodiscard]] AircraftState moving(bool tanker, double t_s) const;
  Scenario s_;
  std::array<Wave, 16> waves_{};
};

/// Errors of one navigation system: first-order Gauss-Markov, drawn at the rate of its messages.
class NavigationErrors {
 public:
  NavigationErrors(const Scenario& scenario, std::uint64_t seed, std::size_t samples);
  /// What is said at a sample in place of the truth; sigmas filled in. `scale` multiplies the errors, not the sigmas.
  [[nodiscard]] AircraftState said(const AircraftState& truth, std::size_t sample, double scale) const;

 private:
  Scenario s_;
  std::vector<std::array<double, 12>> x_;  ///< position, attitude: Gauss-Markov; velocity, rate: white; all of unit variance
};

[[nodiscard]] Pose<frame::R, frame::K> relative(const AircraftState& receiver, const AircraftState& tanker);

}  // namespace cyclops::hil
