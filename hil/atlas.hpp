#pragma once
/// Pictures to judge a tanker's shape by: three views, the receiver's view at two ranges, and a close-up of each feature as the
/// receiver's camera would see it through a long lens.
///
/// Time     some 20 s: three lenses, each with light of its own; 40 close-ups.
/// Threads  one call at a time for a folder. Errors  kIo when a picture cannot be written.
#include <string>

#include "hil/mesh.hpp"

namespace cyclops::hil {

struct AtlasOptions {
  Vec3 reference_m{511 * 0.0254, 0, 123 * 0.0254};  ///< ranges count from here, model axes
  double range_m{80 * 0.3048};                      ///< to the camera
  double elevation_deg{-15}, azimuth_deg{0};        ///< of the camera as seen from the reference point
  double close_up_m{0.8};                           ///< width of a close-up at the feature
};

/// Writes three_view.png, receiver.png, contact.png and features.png (green: visible, red: hidden or facing away).
Result<> draw_atlas(const std::string& folder, const Mesh& mesh, const TankerModel& model, const AtlasOptions& options);

}  // namespace cyclops::hil
