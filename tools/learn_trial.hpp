#pragma once
/// A model on a flight with truth: what its measurements and its poses are worth.
///
/// The true pose of each frame is fitted to the true pixels of the flight's own surveyed features; generated and imported flights
/// have these. A measurement is judged against its feature's place in the model, seen from the true pose: the error holds that
/// of the place and that of the corner. Nothing tells whether a learnt point is really visible, so only what was measured counts.
/// Poses: distance of the lens from its true place in tanker body axes, which boresight does not change.
#include <nlohmann/json.hpp>

#include "tools/learn_views.hpp"

namespace cyclops::tools::learn {

/// Gauss-Newton on pixels, each with its covariance, large residuals held back (Huber at `robust_sigmas`; 0: none).
/// Nothing when fewer than four points, or when it does not converge.
struct PointPixel {
  Point<frame::K> p_k{};
  Vec2 uv_px{0, 0};
  Mat2 cov_px2{Mat2::Identity()};
};
struct FittedPose {
  CameraPose T_c_k{};
  double rms_px{0};        ///< an axis
};
std::optional<FittedPose> fit_pose(const Camera& camera, const std::vector<PointPixel>& points, const CameraPose& start, double robust_sigmas = 0);

/// `tanker`: model file, or empty for the flight's own.
Result<nlohmann::json> try_model(const Stretch& flight, const std::string& tanker, const Profile& profile);

/// One line for people.
[[nodiscard]] std::string trial_line(const nlohmann::json& figures);

}  // namespace cyclops::tools::learn
