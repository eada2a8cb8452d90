#pragma once
/// Flies a scenario and writes it as a flight folder (docs/architecture.md): pixels, messages, truth, rig and figures.
///
/// Two halves  pictures (hil/flight_pictures.hpp), which are kept and shared, and navigation, which a seed of its own draws.
/// Repeatable  the same scenario and seeds give the same bytes, whatever the number of threads.
/// Errors      of the scenario's files and of the folder, by name. A flight that ends in an error leaves nothing behind.
#include <functional>
#include <string>

#include "hil/scenario.hpp"

namespace cyclops::hil {

struct FlightOptions {
  std::string out;               ///< folder; must not be a flight already
  std::string cache;             ///< folder of pictures; empty: `cache` beside `out`
  std::string source;            ///< for the manifest
  int threads{1};
  bool replace{false};
  std::function<void(int done, int of)> progress{};
  std::function<bool()> stop{};  ///< asked between frames; true ends the work with an error
};

struct FlightReport {
  double projection_error_px{0};  ///< mean over frames and visible features of said against true place
  double motion_px{0};            ///< mean motion of visible features from frame to frame
  double visible{0};              ///< mean number of visible features a frame, switched-off ones included
  double doubtful{0};             ///< mean number that truth leaves out of scoring
  bool rendered{false};           ///< else the pictures were there
  double render_s{0};
};

Result<FlightReport> make_flight(const Scenario& scenario, const FlightOptions& options);

}  // namespace cyclops::hil
