#include "align/common_error.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace cyclops::align {
namespace {

constexpr double kAnAxis = 0.849;  // of a Rayleigh distribution, 1 / sqrt(2 ln 2)

TEST(CommonError, GrowsAsFewerFeaturesFindACorner) {
  const AlignConfig config;
  const CommonError error(config);
  EXPECT_DOUBLE_EQ(error.sigma_px({0.9, 4, 3}), kAnAxis * 3 * config.common_share / 2);
  EXPECT_DOUBLE_EQ(error.sigma_px({config.common_support, 4, 3}), kAnAxis * 3 * config.common_share / 2);
  EXPECT_DOUBLE_EQ(error.sigma_px({0.2, 4, 1.5}), kAnAxis * 1.5);
  double before = error.sigma_px({0.7, 16, 1.5});
  for (double support = 0.69; support > 0.4; support -= 0.01) {
    const double now = error.sigma_px({support, 16, 1.5});
    EXPECT_GE(now, before);
    before = now;
  }
}

TEST(CommonError, ShrinksWithTheRootOfTheCornersThatSupportThePose) {
  AlignConfig config;
  config.common_share = 0.9;
  config.common_floor_px = 0.01;
  const CommonError error(config);
  EXPECT_NEAR(error.sigma_px({0.8, 5, 2}) / error.sigma_px({0.8, 20, 2}), 2, 1e-12);
  EXPECT_LE(error.sigma_px({0.8, 0, 2}), 2);
}

TEST(CommonError, PredictionsAllowForMoreThanIsBelieved) {
  const AlignConfig config;
  const CommonError error(config);
  for (double support = 0.9; support > 0.1; support -= 0.02) EXPECT_GE(error.allowed_px({support, 10, 1}), error.sigma_px({support, 10, 1}));
  EXPECT_DOUBLE_EQ(error.allowed_px({config.sure_support, 10, 2}), 2 * config.allowed_share);
  EXPECT_DOUBLE_EQ(error.allowed_px({0.2, 10, 2}), 2);
}

TEST(CommonError, IsSmallWhereCornersLieWhereTheyWereSurveyed) {
  const AlignConfig config;
  const CommonError error(config);
  EXPECT_DOUBLE_EQ(error.sigma_px({1, 20, 0.01}), config.common_floor_px);
  EXPECT_LT(error.sigma_px({0.5, 20, 0.2}), 0.2);
}

TEST(CommonError, FollowsTheLastFramesAndForgetsOnReset) {
  const AlignConfig config;
  CommonError error(config);
  for (int i = 0; i < 200; ++i) error.learn({0.9, 4, 2.0});
  EXPECT_NEAR(error.sigma_px({0.3, 4, 3}), kAnAxis * config.common_share, 1e-3);  // one poor frame does not speak for all
  for (int i = 0; i < 200; ++i) error.learn({0.3, 4, 2.0});
  EXPECT_NEAR(error.sigma_px({0.9, 4, 1}), kAnAxis * 2, 1e-3);
  error.reset();
  EXPECT_DOUBLE_EQ(error.sigma_px({0.9, 4, 1}), std::max(config.common_floor_px, kAnAxis * config.common_share / 2));
}

}  // namespace
}  // namespace cyclops::align
