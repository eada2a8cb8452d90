#pragma once
/// Looks of features from the pictures of a learnt flight, and what each is worth.
///
/// Spread     a picture of a feature begins a look when no look of that flight is near it in direction and scale.
/// Strength   each look is turned to the other views of the feature and searched for around its place there, as in flight. How often it is
///            found, how far its matches scatter and how well they correlate is kept with it; weak ones are left out.
/// Feature    the pose of one view is wrong by a little: the mean distance of the matches from the feature, over the views, is
///            taken off where the look has the feature.
/// Frames     raw pixels; poses as adjusted. Deterministic.
#include "patch/looks.hpp"
#include "patch/patch_config.hpp"
#include "tools/learn_types.hpp"

namespace cyclops::tools::learn {

struct LooksConfig {
  int most_tried{40};            ///< views in which one look is searched for
  int least_matched{4};
  double least_share{0.6};       ///< of those in which it is found
  double most_scatter_px{0.7};   ///< 1 sigma an axis of its matches about their mean
  double most_away_px{1.5};      ///< a match further from the mean is none
  double pose_doubt{0.5};        ///< 1 sigma of what the poses of a flight share, in units of their own (tools/learn_bundle.hpp)
  double independent{4};         ///< so many neighbouring views say as much as one
  int most_of_feature{24};       ///< the strongest stay
};

/// `tanker`: whose features that are switched on get looks; the surveyed ones come first, in the order of `views.tanker`.
Looks learn_looks(const PatchConfig& patch, const LooksConfig& config, const Views& views, const TankerModel& tanker);

}  // namespace cyclops::tools::learn
