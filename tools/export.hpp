#pragma once
/// What a sortie or flight holds, in formats of other programs: tables, pictures, a film.
///
/// Pictures show the frame stretched from its darkest to its brightest counts, accepted measurements as green rings with their
/// feature's number, predictions that got none as amber crosses, and number, GPS time and range on top.
/// Errors name the file. Threads: any.
#include <string>
#include <vector>

#include "base/result.hpp"

namespace cyclops::tools {

struct ExportOptions {
  std::string folder;            ///< a flight or sortie
  std::vector<std::string> logs; ///< what was published, in parts; a sortie's own when empty
  std::string measurements;      ///< CSV
  std::string nav;               ///< CSV
  std::string health;            ///< CSV: every number of HEALTH, one column each counter
  std::string frames;            ///< folder of PNG: exact counts, 8 or 16 bits
  std::string pictures;          ///< folder of PNG with what was measured drawn in
  std::string video;             ///< the same as a film, written by the program ffmpeg
  double from_s{0};              ///< pictures and frames: from here, since the first frame
  double to_s{1e12};
};

struct Exported {
  std::int64_t measurements{0}, nav{0}, health{0}, frames{0}, pictures{0};
};

Result<Exported> export_all(const ExportOptions& options);

}  // namespace cyclops::tools
