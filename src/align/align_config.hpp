#pragma once
/// Table "align" of a profile.
#include "base/config.hpp"

namespace cyclops {

struct AlignConfig {
  bool enabled{true};
  double corner_sigma_px{1.5};    ///< 1 sigma of a corner about its surveyed feature, before the feature has shown its own
  double scatter_gain{0.02};      ///< share of the newest residual in the scatter of a feature; 0: corner_sigma_px for ever
  double scatter_floor_px{0.25};  ///< no feature is trusted to less than this
  double detection_probability{0.7};
  double prior_gate{9.2};         ///< squared Mahalanobis radius in which corners are candidates, 2 dof
  int candidates{14};             ///< corners kept a feature, nearest first
  int features{48};               ///< features used for hypotheses; all are used for the refinement
  int readings{8};                ///< readings grown from the best one-point hypotheses
  double min_evidence{3.0};
  double min_margin{1.0};         ///< over the next different reading;
  double wide_margin{7.0};        ///< this from a prior with a larger 1 sigma
  double wide_px{3.0};            ///< than this on the image, rms of the features, an axis
  int min_inliers{4};             ///< one less when fewer than 7 features can be seen
  double min_support{0.3};        ///< and this share of the features in view
  double inlier_px{3.0};          ///< radius within which a corner supports the final pose
  double robust_scale{1.5};       ///< residuals beyond this many sigma lose their weight
  double common_share{0.4};       ///< error that the features of a frame share, as a share of a corner's typical distance from the pose,
  double sure_support{0.62};      ///< when this share of the features in view finds its corner and more;
  double doubtful_support{0.45};  ///< all of that distance when only this share does; between them in proportion
  double common_floor_px{0.05};   ///< least 1 sigma of that error
  double track_floor_px{1.5};     ///< prediction from earlier frames is never more certain than this
  double track_growth_px_s{6.0};  ///< growth of its uncertainty without consensus
  double track_bonus{60.0};       ///< evidence in favour of going on with the earlier pose, while features have just agreed on it
  double nav_memory_s{1.0};       ///< errors of navigation last so long: what it says more often is weighed as if said once in this time
  double acquire_from_px{25};     ///< a prior with a larger 1 sigma on the image, rms of the features, an axis: the pose is searched for
  int acquire_beam{256};          ///< readings kept in that search
  int acquire_least{6};           ///< features that it has to find
  double acquire_support{0.42};   ///< and this share of those in view
  double acquire_blind_s{1.0};    ///< a lost track is searched for about where it was for so long
  double acquire_evidence{3};     ///< log-likelihood ratio against clutter that it has to have,
  double acquire_margin{5};       ///< and over another pose
  double doubt_px{8};             ///< so far about a pose with less than `sure_support` a better one is looked for; 0: never
  int doubt_beam{16};             ///< readings kept in that search about a pose; about a lost track a quarter of acquire_beam
  double doubt_margin{4};         ///< evidence by which it has to be better
  double search_sigmas{2.5};      ///< a sub-image reaches this many sigma of the prediction beyond the buffer
  double search_most_px{60};      ///< but no further
  double forget_after_s{12.0};    ///< without consensus for so long, earlier frames no longer count
  static Result<AlignConfig> read(ConfigTable& table, AlignConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const AlignConfig&) const = default;
};

}  // namespace cyclops
