#pragma once
/// Table "edge" of a profile.
#include "base/config.hpp"

namespace cyclops {

struct EdgeConfig {
  bool enabled{true};
  int pairs{48};                  ///< pairs of features looked at in a frame: the proven ones first, the rest in turn
  double search_sigmas{2.5};      ///< half width of the search across the edge, in sigmas of the aligned prediction, but
  double search_least_px{3};
  double search_most_px{8};
  double contrast_sigmas{4};      ///< least gradient, in sigmas of the pixel noise
  double coverage{0.75};          ///< least share of the segment where the edge is seen
  double straight_px{0.7};        ///< a sample further from the line is not part of it
  double bias_sigma_px{0.5};      ///< 1 sigma of an edge about the segment of the model, before it has shown its own
  double bias_gain{0.05};         ///< share of the newest residual in it
  double bias_floor_px{0.15};
  double proven{0.5};             ///< least strength, 0..1, of an edge that is used
  double strength_gain{0.15};     ///< share of the newest frame in the strength
  double crossing_sigma_px{1.0};  ///< edges give a feature's place when its larger 1 sigma is below this

  /// `table` is [edge]; range errors are collected there.
  [[nodiscard]] static Result<EdgeConfig> read(ConfigTable& table, EdgeConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const EdgeConfig&) const = default;
};

}  // namespace cyclops
