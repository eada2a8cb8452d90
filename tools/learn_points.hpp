#pragma once
/// Corners followed from view to view, and where on the tanker they are.
///
/// Follow   A corner that nobody claims begins a point: on its line of sight, at the depth of the surveyed features around it,
///          as uncertain as these differ in depth. The aligned pose of the next view says where it should be and how far off it
///          may be; the corner that fits place and looks best continues it. With each sight it is triangulated anew.
/// Finish   Points that were seen often, scatter little and lie within the extent of the surveyed features; of two in the same
///          place the one with more sights.
/// Match    With places known, every view is gone through once more: each point to its nearest corner, one to one.
/// Deterministic; no random numbers.
#include <optional>

#include "tools/learn_types.hpp"

namespace cyclops::tools::learn {

struct FollowConfig {
  double pose_px{0.5};          ///< 1 sigma of a predicted place from the errors of the poses, an axis
  double gate{11.8};            ///< squared Mahalanobis distance, 2 degrees of freedom
  double most_px{12};           ///< and no further than this
  double least_correlation{0.7};
  double look_sigma{0.1};       ///< 1 - correlation, 1 sigma
  int most_misses{4};           ///< in a row
  int least_sights{8};
  double most_rms_px{1.0};      ///< residual an axis
  double beyond{0.1};           ///< a point may lie outside the surveyed features by this share of their extent
  double same_px{1.2};          ///< two points that are nearer in their views are one
};

/// Where a point may be before its corners are looked at.
struct PointPrior {
  Point<frame::K> p_k{};
  Mat3 cov_m2{Mat3::Identity()};
};

struct Located {
  Point<frame::K> p_k{};
  Mat3 cov_m2{Mat3::Identity()};
  double rms_px{0};             ///< residual an axis
};

/// Gauss-Newton from the prior, each corner as certain as its own covariance and `pose_px` say, large residuals held back
/// (Huber). Nothing when it does not converge before every camera. At most 40 sights are used, evenly spread.
std::optional<Located> triangulate(const std::vector<View>& views, const std::vector<Sight>& sights, const PointPrior& prior, double pose_px);

std::vector<LearntPoint> follow(const Views& views, const FollowConfig& config);

/// Fills the sights of every point anew: the nearest corner within `radius_px`, one to one, nearest pairs first.
void match_all(const std::vector<View>& views, double radius_px, std::vector<LearntPoint>& points);

}  // namespace cyclops::tools::learn
