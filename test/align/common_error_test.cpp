#include "align/common_error.hpp"

#include <gtest/gtest.h>

namespace cyclops::align {
namespace {

TEST(CommonError, GrowsAsFewerFeaturesFindACorner) {
  const AlignConfig config;
  const CommonError error(config);
  EXPECT_DOUBLE_EQ(error.sigma_px(0.9, 1.5), 1.5 * config.common_share);
  EXPECT_DOUBLE_EQ(error.sigma_px(config.sure_support, 1.5), 1.5 * config.common_share);
  EXPECT_DOUBLE_EQ(error.sigma_px(0.2, 1.5), 1.5);
  double before = error.sigma_px(0.7, 1.5);
  for (double support = 0.69; support > 0.4; support -= 0.01) {
    const double now = error.sigma_px(support, 1.5);
    EXPECT_GE(now, before);
    before = now;
  }
}

TEST(CommonError, IsSmallerWhereThePoseIsHeldButNotThatOfGoodCorners) {
  const AlignConfig config;
  const CommonError error(config);
  EXPECT_LT(error.sigma_px(0.2, 1.5, true), 0.85 * error.sigma_px(0.2, 1.5));
  EXPECT_GT(error.sigma_px(0.2, 1.5, true), error.sigma_px(0.9, 1.5));
  EXPECT_DOUBLE_EQ(error.sigma_px(0.9, 1.5, true), error.sigma_px(0.9, 1.5));
}

TEST(CommonError, IsSmallWhereCornersLieWhereTheyWereSurveyed) {
  const AlignConfig config;
  const CommonError error(config);
  EXPECT_DOUBLE_EQ(error.sigma_px(1, 0.01), config.common_floor_px);
  EXPECT_LT(error.sigma_px(0.5, 0.2), 0.2);
}

TEST(CommonError, FollowsTheLastFramesAndForgetsOnReset) {
  const AlignConfig config;
  CommonError error(config);
  for (int i = 0; i < 200; ++i) error.learn(0.9, 1.0);
  EXPECT_NEAR(error.sigma_px(0.3, 2), config.common_share, 1e-3);  // one poor frame does not speak for all
  for (int i = 0; i < 200; ++i) error.learn(0.3, 2.0);
  EXPECT_NEAR(error.sigma_px(0.9, 1), 2, 1e-3);
  error.reset();
  EXPECT_DOUBLE_EQ(error.sigma_px(0.9, 1), config.common_share);
}

}  // namespace
}  // namespace cyclops::align
