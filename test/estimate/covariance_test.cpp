// Each analytic Jacobian behind Prediction::cov_px2 against a numerical one: one error source at a time is switched on, and
// the covariance it gives is compared with what moving the input by a small step does to the predicted pixel.
#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "test/scene.hpp"

namespace cyclops {
namespace {

struct Inputs {
  RelativeState state{test::relative_state({12, -7, 25}, {33, 1.5, -6})};
  CameraMount mount{test::mount_deg(3, 16, -2, {2.4, -0.15, -0.6})};
  double focal_scale{1};
  Vec3 moved_in{0, 0, 0};  ///< every feature moved, inches
};

Windscreen smooth_windscreen() {
  std::vector<float> du, dv;
  for (int i = 0; i < 65; ++i)
    for (int j = 0; j < 65; ++j) {
      du.push_back(static_cast<float>(0.0008 * i * j));
      dv.push_back(static_cast<float>(-0.02 * i + 0.01 * j));
    }
  return Windscreen::from_grids(65, 65, 16, du, dv).value();
}

std::unique_ptr<PredictionSet> run(const Inputs& in, const EstimateConfig& config) {
  Intrinsics k;
  k.k1 = -0.2; k.k2 = 0.05; k.p1 = 1e-3; k.p2 = -5e-4;
  k.fx_px *= in.focal_scale;
  k.fy_px *= in.focal_scale;
  const Vec3 ins = Vec3(190, 0, 95) - in.moved_in;
  const auto model = TankerModel::parse("id,x,y,z,sigma\n2,539,0,131,0.5\n15,300,318,120,0.5\n22,300,-318,120,0.5\n", "test", 0.0254, ins).value();
  auto out = std::make_unique<PredictionSet>();
  predict(in.state, model, Camera(k, smooth_windscreen()), in.mount, config, *out);
  return out;
}

/// sigma^2 J J^T with J by central differences over `axes` inputs that `move` displaces by h.
Mat2 numeric_covariance(std::size_t i, int axes, double h, double sigma, const std::function<void(Inputs&, int, double)>& move) {
  Mat2 P = Mat2::Zero();
  for (int a = 0; a < axes; ++a) {
    Inputs plus, minus;
    move(plus, a, h);
    move(minus, a, -h);
    const Vec2 J = (run(plus, {})->items[i].uv_px - run(minus, {})->items[i].uv_px) / (2 * h);
    P += sigma * sigma * J * J.transpose();
  }
  return P;
}

EstimateConfig silent() {
  EstimateConfig c;
  c.focal_sigma = c.windscreen_sigma_px = c.survey_scale = 0;
  return c;
}

void expect_covariance(const Inputs& in, const EstimateConfig& config, int axes, double h, double sigma,
                       const std::function<void(Inputs&, int, double)>& move) {
  const auto set = run(in, config);
  for (std::size_t i = 0; i < 3; ++i) {
    const Mat2 want = numeric_covariance(i, axes, h, sigma, move);
    EXPECT_GT(want.norm(), 1e-4);
    EXPECT_LT((set->items[i].cov_px2 - want).norm(), 2e-3 * want.norm()) << set->items[i].cov_px2 << "\n" << want;
  }
}

TEST(EstimateCovariance, AttitudeErrorAgreesWithItsNumericalEffect) {
  Inputs in;
  in.state.covariance.topLeftCorner<3, 3>() = Mat3::Identity() * 0.01 * 0.01;
  expect_covariance(in, silent(), 3, 1e-5, 0.01, [](Inputs& x, int a, double h) {
    const Rotation<frame::R, frame::R> turn(so3_exp(Vec3::Unit(a) * h));
    x.state.T_r_k = {turn * x.state.T_r_k.rotation(), x.state.T_r_k.translation()};
  });
}

TEST(EstimateCovariance, PositionErrorAgreesWithItsNumericalEffect) {
  Inputs in;
  in.state.covariance.bottomRightCorner<3, 3>() = Mat3::Identity() * 0.2 * 0.2;
  expect_covariance(in, silent(), 3, 1e-4, 0.2, [](Inputs& x, int a, double h) {
    x.state.T_r_k = {x.state.T_r_k.rotation(), Point<frame::R>(x.state.T_r_k.translation().xyz + Vec3::Unit(a) * h)};
  });
}

TEST(EstimateCovariance, CorrelatedNavigationErrorIsCarriedThrough) {
  Inputs in;  // one error that turns about z and moves along y together
  Eigen::Matrix<double, 6, 1> direction = Eigen::Matrix<double, 6, 1>::Zero();
  direction[2] = 0.01;
  direction[4] = -0.3;
  in.state.covariance = direction * direction.transpose();
  expect_covariance(in, silent(), 1, 1e-4, 1, [&](Inputs& x, int, double h) {
    const Rotation<frame::R, frame::R> turn(so3_exp(direction.head<3>() * h));
    x.state.T_r_k = {turn * x.state.T_r_k.rotation(), Point<frame::R>(x.state.T_r_k.translation().xyz + direction.tail<3>() * h)};
  });
}

TEST(EstimateCovariance, BoresightErrorAgreesWithItsNumericalEffect) {
  Inputs in;
  in.mount.boresight_sigma_rad = 0.1 * test::kDeg;
  expect_covariance(in, silent(), 3, 1e-5, 0.1 * test::kDeg, [](Inputs& x, int a, double h) {
    x.mount.R_c_r = Rotation<frame::C, frame::C>(so3_exp(Vec3::Unit(a) * h)) * x.mount.R_c_r;
  });
}

TEST(EstimateCovariance, SurveyErrorAgreesWithItsNumericalEffect) {
  EstimateConfig config = silent();
  config.survey_scale = 1;
  expect_covariance({}, config, 3, 1e-2, 0.5, [](Inputs& x, int a, double h) { x.moved_in = Vec3::Unit(a) * h; });
}

TEST(EstimateCovariance, FocalErrorAgreesWithItsNumericalEffect) {
  EstimateConfig config = silent();
  config.focal_sigma = 0.002;
  expect_covariance({}, config, 1, 1e-5, 0.002, [](Inputs& x, int, double h) { x.focal_scale = 1 + h; });
}

TEST(EstimateCovariance, WindscreenErrorIsAddedToEachAxis) {
  EstimateConfig config = silent();
  config.windscreen_sigma_px = 1.5;
  EXPECT_LT((run({}, config)->items[0].cov_px2 - 2.25 * Mat2::Identity()).norm(), 1e-12);
}

}  // namespace
}  // namespace cyclops
