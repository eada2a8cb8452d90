#include "tools/learn_bundle.hpp"

#include <algorithm>
#include <cmath>

#include <ceres/ceres.h>
#include <ceres/covariance.h>

#include "tools/learn_cost.hpp"

// Debian builds Ceres without AVX, so its Eigen aligns memory otherwise than ours: nothing but plain double may pass between them.

namespace cyclops::tools::learn {
namespace {

using Pose6 = std::array<double, 6>;

double mean_metres_per_px(const std::vector<View>& views, const LearntPoint& p) {
  double sum = 0;
  for (const Sight& s : p.sights) {
    const View& v = views[static_cast<std::size_t>(s.view)];
    sum += (v.T_c_k * p.p_k).xyz.z() / v.camera->intrinsics().fx_px;
  }
  return p.sights.empty() ? 0 : sum / static_cast<double>(p.sights.size());
}

class Adjustment {
 public:
  Adjustment(const BundleConfig& config, Views& views, std::vector<LearntPoint>& points) : config_(config), all_(views), points_(points), change_(views.views.size(), Pose6{}) {}

  Result<> run() {
    build();
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.max_num_iterations = config_.iterations;
    options.function_tolerance = 1e-7;
    options.num_threads = 1;  // the same bits at every run
    options.logging_type = ceres::SILENT;
    options.linear_solver_ordering.reset(order());
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (!summary.IsSolutionUsable()) return make_error(ErrorCode::kUnusable, "bundle adjustment", summary.message + ", expected a solution");
    if (config_.covariance) CYCLOPS_TRY(covariances());
    for (std::size_t v = 0; v < change_.size(); ++v)
      if (used_[v]) all_.views[v].T_c_k = align::moved(all_.views[v].T_c_k, Eigen::Map<const align::Vec6>(change_[v].data()));
    return Ok{};
  }

 private:
  void build() {
    used_.assign(change_.size(), false);
    for (LearntPoint& p : points_) {
      const double sigma = std::max(config_.corner_floor_px, p.scatter_px);
      for (const Sight& s : p.sights) {
        const auto v = static_cast<std::size_t>(s.view);
        used_[v] = true;
        const View& view = all_.views[v];
        problem_.AddResidualBlock(new CornerCost(*view.camera, view.T_c_k, view.corners[static_cast<std::size_t>(s.corner)].uv_px, sigma),
                                  new ceres::CauchyLoss(config_.robust_sigmas), change_[v].data(), p.p_k.xyz.data());
      }
      if (p.survey >= 0 && !p.sights.empty()) tie(p);
    }
    std::vector<double> of_flight(all_.flights.size(), 0);
    for (std::size_t v = 0; v < change_.size(); ++v) of_flight[static_cast<std::size_t>(all_.views[v].flight)] += used_[v] ? 1 : 0;
    for (std::size_t v = 0; v < change_.size(); ++v) {
      const double shared = config_.pose_doubt * config_.pose_doubt * of_flight[static_cast<std::size_t>(all_.views[v].flight)];
      if (used_[v]) problem_.AddResidualBlock(new PosePrior(shared * all_.views[v].covariance), nullptr, change_[v].data());
    }
  }

  void tie(LearntPoint& p) {
    const Feature& f = all_.tanker.features()[static_cast<std::size_t>(p.survey)];
    const double sigma = std::hypot(f.sigma_m, config_.tie_sigma_px * mean_metres_per_px(all_.views, p));
    problem_.AddResidualBlock(new SurveyTie(all_.tanker.in_body(f), sigma), new ceres::CauchyLoss(config_.robust_sigmas), p.p_k.xyz.data());
  }

  ceres::ParameterBlockOrdering* order() {
    auto* out = new ceres::ParameterBlockOrdering;
    for (LearntPoint& p : points_)
      if (!p.sights.empty()) out->AddElementToGroup(p.p_k.xyz.data(), 0);
    for (std::size_t v = 0; v < change_.size(); ++v)
      if (used_[v]) out->AddElementToGroup(change_[v].data(), 1);
    return out;
  }

  Result<> covariances() {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    std::vector<const double*> blocks;
    for (const LearntPoint& p : points_)
      if (!p.sights.empty()) blocks.push_back(p.p_k.xyz.data());
    std::vector<std::pair<const double*, const double*>> pairs;
    for (const double* b : blocks) pairs.emplace_back(b, b);
    if (!covariance.Compute(pairs, &problem_)) return make_error(ErrorCode::kUnusable, "bundle adjustment", "covariance is singular, expected poses and points that the corners determine");
    for (LearntPoint& p : points_) {
      if (p.sights.empty()) continue;
      Eigen::Matrix<double, 3, 3, Eigen::RowMajor> c;
      covariance.GetCovarianceBlock(p.p_k.xyz.data(), p.p_k.xyz.data(), c.data());
      p.cov_m2 = c;
    }
    return Ok{};
  }

  BundleConfig config_;
  Views& all_;
  std::vector<LearntPoint>& points_;
  std::vector<Pose6> change_;
  std::vector<bool> used_;
  ceres::Problem problem_;
};

}  // namespace

Result<> adjust(const BundleConfig& config, Views& views, std::vector<LearntPoint>& points) {
  if (std::all_of(points.begin(), points.end(), [](const LearntPoint& p) { return p.sights.empty(); }))
    return make_error(ErrorCode::kUnusable, "bundle adjustment", "no point has a corner, expected at least one");
  return Adjustment(config, views, points).run();
}

}  // namespace cyclops::tools::learn
