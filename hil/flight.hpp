#pragma once
/// Flies a scenario and writes it as a flight folder (docs/architecture.md): pixels, messages, truth and rig.
///
/// Repeatable  the same scenario and seed give the same bytes, whatever the number of threads.
/// Errors      of the scenario's files and of the folder, by name.
#include <functional>
#include <string>

#include "hil/scenario.hpp"

namespace cyclops::hil {

struct FlightOptions {
  std::string out;               ///< folder; must not be a flight already
  std::string source;            ///< for the manifest
  int threads{1};
  bool replace{false};
  std::function<void(int done, int of)> progress{};
};

struct FlightReport {
  double projection_error_px{0};  ///< mean over frames and features of said against true place
  double error_scale{1};          ///< what the drawn errors were multiplied by
  double motion_px{0};            ///< mean motion of features from frame to frame
  double visible{0};              ///< mean number of visible features a frame, switched-off ones included
  double doubtful{0};             ///< mean number that truth leaves out of scoring
  double render_ms{0};            ///< mean time a frame of one thread
};

Result<FlightReport> make_flight(const Scenario& scenario, const FlightOptions& options);

}  // namespace cyclops::hil
