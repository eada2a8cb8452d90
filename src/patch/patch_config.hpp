#pragma once
/// Table "patch" of a profile.
#include "base/config.hpp"

namespace cyclops {

struct PatchConfig {
  bool enabled{true};
  int half_px{5};                 ///< a patch is 2 half + 1 pixels square
  double least_correlation{0.8};  ///< normalised cross-correlation of a match
  double search_sigmas{2.5};      ///< half width of the search, in sigmas of the aligned prediction, but at most
  double search_most_px{4};
  double view_deg{4};             ///< a view turned further than this is looked at anew
  double scale{1.2};              ///< or nearer, or further, by this factor
  double least_support{0.3};      ///< share of the features in view whose corners agree with the pose, below which no match is used
  double anchor_floor_px{0.15};   ///< least 1 sigma of a patch about its feature, however long it has been watched
  double steady_px{1.0};          ///< most rms an axis of a patch about its anchor
  int hold_frames{10};            ///< seen for so long, and
  double hold_steady_px{0.7};     ///< about its anchor within this rms an axis, a patch holds the pose; hold_frames 0: none does
  double hold_floor_px{0.5};      ///< 1 sigma an axis of what its anchor still has of the poses it was learnt from
  double sigma_most_px{2.0};      ///< a match is used when its larger 1 sigma is below this

  /// `table` is [patch]; range errors are collected there.
  [[nodiscard]] static Result<PatchConfig> read(ConfigTable& table, PatchConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const PatchConfig&) const = default;
};

}  // namespace cyclops
