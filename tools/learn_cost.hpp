#pragma once
/// Inside learn: residuals of the bundle adjustment for Ceres, with analytic Jacobians. Each is in units of its sigma.
#include <cmath>

#include <Eigen/Cholesky>
#include <ceres/sized_cost_function.h>

#include "align/pose.hpp"

namespace cyclops::tools::learn {

template <int Rows, int Cols>
using RowMajor = Eigen::Matrix<double, Rows, Cols, Cols == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

/// d log(exp(e) exp(a)) by e at 0, inverted: a change of the rotation vector a turns by J da. Barfoot 2017, left Jacobian of SO(3).
inline Mat3 so3_left_jacobian(const Vec3& a) {
  const double angle = a.norm();
  const Mat3 S = skew(a);
  if (angle < 1e-5) return Mat3::Identity() + 0.5 * S;
  return Mat3::Identity() + (1 - std::cos(angle)) / (angle * angle) * S + (angle - std::sin(angle)) / (angle * angle * angle) * S * S;
}

/// Corner less projected point. Parameters: change of the pose (align::moved), point in k, m.
class CornerCost : public ceres::SizedCostFunction<2, 6, 3> {
 public:
  CornerCost(const Camera& camera, const align::CameraPose& T_c_k, const Vec2& uv_px, double sigma_px)
      : camera_(camera), T_(T_c_k), uv_(uv_px), sigma_(sigma_px) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const align::Vec6> d(parameters[0]);
    const Point<frame::K> p{Vec3(Eigen::Map<const Vec3>(parameters[1]))};
    const align::CameraPose pose = align::moved(T_, d);
    const auto at = align::projected(camera_, pose, p);
    if (!at) return false;
    Eigen::Map<Vec2>{residuals} = (uv_ - at->uv) / sigma_;
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      RowMajor<2, 6> J = -at->by_pose / sigma_;
      J.leftCols<3>() = (J.leftCols<3>() * so3_left_jacobian(d.head<3>())).eval();
      Eigen::Map<RowMajor<2, 6>>{jacobians[0]} = J;
    }
    if (jacobians[1] != nullptr) Eigen::Map<RowMajor<2, 3>>{jacobians[1]} = -at->by_point * pose.rotation().matrix() / sigma_;
    return true;
  }

 private:
  const Camera& camera_;
  align::CameraPose T_;
  Vec2 uv_;
  double sigma_;
};

/// Change of a pose, as uncertain as the covariance.
class PosePrior : public ceres::SizedCostFunction<6, 6> {
 public:
  explicit PosePrior(const Mat6& covariance) : root_(Eigen::LLT<Mat6>(covariance.inverse()).matrixU()) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Map<align::Vec6>{residuals} = root_ * Eigen::Map<const align::Vec6>(parameters[0]);
    if (jacobians != nullptr && jacobians[0] != nullptr) Eigen::Map<RowMajor<6, 6>>{jacobians[0]} = root_;
    return true;
  }

 private:
  Mat6 root_;  ///< upper triangular, root^T root = information
};

/// Point less surveyed place, k axes.
class SurveyTie : public ceres::SizedCostFunction<3, 3> {
 public:
  SurveyTie(const Point<frame::K>& p_k, double sigma_m) : p_(p_k.xyz), sigma_(sigma_m) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Map<Vec3>{residuals} = (Eigen::Map<const Vec3>(parameters[0]) - p_) / sigma_;
    if (jacobians != nullptr && jacobians[0] != nullptr) Eigen::Map<RowMajor<3, 3>>{jacobians[0]} = Mat3::Identity() / sigma_;
    return true;
  }

 private:
  Vec3 p_;
  double sigma_;
};

}  // namespace cyclops::tools::learn
