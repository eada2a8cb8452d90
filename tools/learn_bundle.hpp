#pragma once
/// Poses of all views and places of all points together, so that every corner falls where it was seen: bundle adjustment.
///
/// Unknown   a change of each view's aligned pose (6), the place of each point (3).
/// Corners   residual / sigma of the point, Cauchy loss.
/// Poses     prior: the aligned pose with its covariance times the number of views of its flight and `pose_doubt` squared. The
///           aligner's errors are shared by the frames of a flight (it weighs the same features in each), so a flight says about as
///           much as few poses do. This prior holds the axes where little is tied to the survey.
/// Survey    a point that is where a surveyed feature is, is tied to it by the survey's sigma, Cauchy loss: a corner that is
///           another point after all lets go. Both together fix what corners alone cannot know: the tanker's own axes.
/// Result    the covariance of each point is the solver's, with poses and ties unknown as they are.
/// Errors    kUnusable when the solver fails or the covariance cannot be had.
/// Source    Triggs et al. 2000 for the method; Ceres solves it.
#include "base/result.hpp"
#include "tools/learn_types.hpp"

namespace cyclops::tools::learn {

struct BundleConfig {
  double robust_sigmas{2};        ///< scale of the Cauchy loss of corners
  double tie_sigma_px{0.15};      ///< a corner may be off the surveyed place by this, on average over its views, besides
  double pose_doubt{0.5};         ///< 1 sigma of what the aligned poses of a flight share, in units of their own
  double corner_floor_px{0.1};    ///< no corner is trusted to less
  int iterations{25};
  bool covariance{false};         ///< of the points; takes longer
};

/// Moves poses and points; fills cov_m2 when asked for. `scatter_px` of each point is the sigma of its corners.
Result<> adjust(const BundleConfig& config, Views& views, std::vector<LearntPoint>& points);

}  // namespace cyclops::tools::learn
