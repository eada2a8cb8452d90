#include "tools/true_pose.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops::tools {

std::optional<FittedPose> fit_pose(const Camera& camera, const std::vector<PointPixel>& points, const align::CameraPose& start, double robust_sigmas) {
  if (points.size() < 4) return std::nullopt;
  FittedPose out{start, 0};
  for (int iteration = 0; iteration < 30; ++iteration) {
    Mat6 H = 1e-12 * Mat6::Identity();
    align::Vec6 g = align::Vec6::Zero();
    double sum = 0;
    for (const PointPixel& p : points) {
      const auto at = align::projected(camera, out.T_c_k, p.p_k);
      if (!at) return std::nullopt;
      const Vec2 r = p.uv_px - at->uv;
      const Mat2 W = p.cov_px2.inverse();
      const double m = std::sqrt(r.dot(W * r)), weight = robust_sigmas > 0 && m > robust_sigmas ? robust_sigmas / m : 1;
      H += weight * at->by_pose.transpose() * W * at->by_pose;
      g += weight * at->by_pose.transpose() * (W * r);
      sum += r.squaredNorm();
    }
    out.rms_px = std::sqrt(0.5 * sum / static_cast<double>(points.size()));
    const align::Vec6 change = H.ldlt().solve(g);
    if (!change.allFinite()) return std::nullopt;
    out.T_c_k = align::moved(out.T_c_k, change);
    if (change.norm() < 1e-9) return out;
  }
  return robust_sigmas > 0 ? std::optional(out) : std::nullopt;
}

std::optional<FittedPose> true_pose(const Camera& camera, const TankerModel& own, const truth_t& truth, const align::CameraPose& start) {
  std::vector<PointPixel> points;
  for (std::size_t i = 0; i < truth.id.size(); ++i) {
    const auto f = std::find_if(own.features().begin(), own.features().end(), [&](const Feature& x) { return x.id == truth.id[i]; });
    const Vec2 uv(truth.u_px[i], truth.v_px[i]);
    const bool exact = truth.has_pose || truth.visible[i] == truth_t::VISIBLE;
    if (f != own.features().end() && camera.inside(uv) && exact) points.push_back({own.in_body(*f), uv, Mat2::Identity()});
  }
  return fit_pose(camera, points, start);
}

}  // namespace cyclops::tools
