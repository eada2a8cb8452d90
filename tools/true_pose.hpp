#pragma once
/// The true pose of a frame, fitted to the true pixels of the flight's own features: generated and imported flights have these.
/// It is camera from tanker body as the rig file's camera sees it, so the flight's boresight error is part of it, as it is of an
/// aligned pose. A feature that the truth does not know, a learnt one, is judged by where this pose puts it.
///
/// Frames raw pixels; k axes, m. Threads: any. Memory: heap; nothing here runs in flight.
#include <optional>
#include <vector>

#include <cyclops/truth_t.hpp>

#include "align/pose.hpp"
#include "geometry/tanker_model.hpp"

namespace cyclops::tools {

struct PointPixel {
  Point<frame::K> p_k{};
  Vec2 uv_px{0, 0};
  Mat2 cov_px2{Mat2::Identity()};
};

struct FittedPose {
  align::CameraPose T_c_k{};
  double rms_px{0};        ///< an axis
};

/// Gauss-Newton on pixels, each with its covariance, large residuals held back (Huber at `robust_sigmas`; 0: none).
/// Nothing when fewer than four points, or when it does not converge.
std::optional<FittedPose> fit_pose(const Camera& camera, const std::vector<PointPixel>& points, const align::CameraPose& start, double robust_sigmas = 0);

/// `own`: the model that the truth's features are of. Features inside the image count; of an imported flight, whose pixels were
/// measured, those that are visible.
std::optional<FittedPose> true_pose(const Camera& camera, const TankerModel& own, const truth_t& truth, const align::CameraPose& start);

}  // namespace cyclops::tools
