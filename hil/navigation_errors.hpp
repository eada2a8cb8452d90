#pragma once
/// What the navigation of both aircraft says in place of the truth.
///
/// Errors   each aircraft: position and attitude first-order Gauss-Markov, velocity and rate white; one more position error that
///          both share. All times a course over the flight that is one number a sample. Stated sigmas: those of what is not
///          shared, times the same course and `stated_sigma_factor`.
/// Reduction  kFlightPath: the relative position is given along the receiver's flight path as if that were its body: the
///          receiver's attitude is said with track and climb angle in place of heading and pitch, and the tanker's so that their
///          relative attitude stays (spec 3.5).
/// Point    positions and velocities are those of the TSPI points.
/// Threads  const use from any. Repeatable: a function of scenario and seed.
#include <array>
#include <vector>

#include "hil/flight_messages.hpp"
#include "hil/scenario.hpp"

namespace cyclops::hil {

struct Said { AircraftState receiver, tanker; };

class NavigationErrors {
 public:
  NavigationErrors(const Navigation& navigation, std::uint64_t seed, std::size_t samples);
  /// Errors times `course[sample]`; stated sigmas as well when the scenario says that they follow, else times its median.
  void set_course(std::vector<double> course);
  [[nodiscard]] Said said(const AircraftState& receiver, const AircraftState& tanker, std::size_t sample) const;
  /// The same with another size of the errors at this sample.
  [[nodiscard]] Said said_at_scale(const AircraftState& receiver, const AircraftState& tanker, std::size_t sample, double scale) const;

 private:
  /// Of unit variance: position, attitude, velocity, rate.
  using Draw = std::array<double, 12>;
  [[nodiscard]] AircraftState one(const AircraftState& truth, const Draw& x, const Vec3& shared, double scale, double stated) const;
  Navigation n_;
  std::vector<Draw> receiver_, tanker_;
  std::vector<Vec3> shared_;
  std::vector<double> course_;
  double usual_{1};
};

/// What the link makes of one aircraft's reports: when each arrives, ns of the service clock; none: lost, two: sent twice.
struct Link {
  double latency_ms{0}, jitter_ms{0};
  double dropouts_per_minute{0}, dropout_s{0.4}, duplicate_share{0}, swapped_share{0};
};
[[nodiscard]] std::vector<std::vector<std::int64_t>> arrivals(const Link& link, double rate_hz, std::int64_t start_ns, std::size_t samples, std::uint64_t seed);

}  // namespace cyclops::hil
