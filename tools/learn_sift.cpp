#include "tools/learn_sift.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

namespace cyclops::tools::learn {

Extent::Extent(const TankerModel& tanker) {
  for (const Feature& f : tanker.features()) {
    const Vec3 p = tanker.in_body(f).xyz;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
}

bool Extent::holds(const Vec3& p_k, double beyond_m) const { return ((p_k - low).array() > -beyond_m).all() && ((high - p_k).array() > -beyond_m).all(); }

double loosest_sigma_m(const BundleConfig& config, const std::vector<View>& views, const LearntPoint& point) {
  const double variance = std::pow(std::max(config.corner_floor_px, point.scatter_px), 2), scale = config.robust_sigmas * config.robust_sigmas;
  Mat3 H = Mat3::Zero();
  for (const Sight& s : point.sights) {
    const View& view = views[static_cast<std::size_t>(s.view)];
    const auto at = align::projected(*view.camera, view.T_c_k, point.p_k);
    if (!at) continue;
    const Eigen::Matrix<double, 2, 3> J = at->by_point * view.T_c_k.rotation().matrix();
    const double square = (view.corners[static_cast<std::size_t>(s.corner)].uv_px - at->uv).squaredNorm() / variance;
    H += J.transpose() * J / (variance * (1 + square / scale));  // Cauchy
  }
  const double least = Eigen::SelfAdjointEigenSolver<Mat3>(H, Eigen::EigenvaluesOnly).eigenvalues()[0];
  return least > 0 ? 1 / std::sqrt(least) : std::numeric_limits<double>::infinity();
}

Sifted sift(const BundleConfig& config, double beyond, const Views& views, std::vector<LearntPoint>& points) {
  const Extent extent(views.tanker);
  Sifted out;
  std::erase_if(points, [&](const LearntPoint& p) {
    const bool outside = !extent.holds(p.p_k.xyz, beyond * extent.size());
    const bool undetermined = !outside && p.survey < 0 && !(loosest_sigma_m(config, views.views, p) < extent.size());
    out.outside += outside ? 1 : 0;
    out.undetermined += undetermined ? 1 : 0;
    return outside || undetermined;
  });
  return out;
}

}  // namespace cyclops::tools::learn
