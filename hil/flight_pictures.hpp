#pragma once
/// The half of a flight that the camera and the truth make: frames, strobe edges, TRUTH. Navigation takes no part in it, so
/// flights that differ in navigation alone share one rendering.
///
/// Cache    a folder of flights without TSPI, one for each content: the key is a SHA-256 over every pose, every time and the
///          pixels and truth of the first, middle and last frame, so that another scenario, tanker, seed or renderer is another
///          content. Several processes may share one: they draw in turn. A folder that was not finished is not there (record/flight.hpp).
/// Repeatable  the same bytes whatever the number of threads.
#include <functional>
#include <string>

#include "hil/flight_scene.hpp"

namespace cyclops::hil {

struct PictureOptions {
  std::string cache;             ///< folder
  int threads{1};
  std::function<void(int done, int of)> progress{};  ///< not called when the pictures are there already
  std::function<bool()> stop{};  ///< true ends the work; nothing is left behind
};

struct Pictures {
  std::string folder;            ///< a flight (record/flight.hpp) with frames, FRAME, STROBE, TRUTH and picture.json
  bool rendered{false};          ///< else they were in the cache
  double render_s{0};            ///< wall time
};

Result<Pictures> make_pictures(const FlightScene& scene, const PictureOptions& options);

}  // namespace cyclops::hil
