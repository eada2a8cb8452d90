#pragma once
/// Recorded flights, run through the chain, as views: frames with an aligned pose and every corner around the tanker.
#include <functional>

#include "record/flight.hpp"
#include "service/profile.hpp"
#include "tools/learn_types.hpp"

namespace cyclops::tools::learn {

/// A flight folder, or a part of it: "build/flights/s1@0-20" are its first 20 seconds.
struct Stretch {
  std::string folder;
  double from_s{0};
  double to_s{1e9};
  static Result<Stretch> parse(const std::string& text);
  /// How many frames of the flight reach its end.
  [[nodiscard]] std::int64_t frames(const FlightManifest& manifest) const;
};

struct ViewsConfig {
  int most_views{120};        ///< of one flight, evenly spread over its stretch
  int most_corners{500};      ///< of one view; the strongest stay
  double margin{0.08};        ///< the area searched reaches beyond the surveyed features by this share of their extent, but
  double margin_least_px{20}; ///< at least so far
  bool pictures{false};       ///< views keep the part of the frame that was searched
};

/// Frames without consensus are left out. Errors: kInvalid when the flights are not of the same surveyed tanker or no frame
/// has a pose. `said` is told each flight when it begins, or empty.
Result<Views> views_of(const std::vector<Stretch>& flights, const Profile& profile, const ViewsConfig& config,
                       const std::function<void(const std::string&)>& said = {});

/// Surroundings of a pixel, mean 0 and norm 1; false when they are not all in the image or have no contrast.
bool take_patch(const ImageView& image, const Vec2& uv_px, Patch& out);

}  // namespace cyclops::tools::learn
