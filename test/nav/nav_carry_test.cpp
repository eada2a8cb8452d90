#include "nav/nav_carry.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

RelativeState state() {
  RelativeState s;
  s.valid = true;
  s.T_r_k = {Rotation<frame::R, frame::K>(Eigen::Quaterniond::Identity()), Point<frame::R>(Vec3(30, 1, -8))};
  s.velocity_r = {-0.5, 0.2, 0.1};
  s.rate_r = {0.02, 0, -0.01};
  s.covariance = 0.01 * Mat6::Identity();
  return s;
}

Time at(double s) { return Time{static_cast<std::int64_t>(1e9 * (10 + s))}; }

TEST(NavCarry, MovesTheLastUpdateOnWithItsVelocityAndRate) {
  NavConfig config;
  NavCarry carry(config);
  const RelativeState first = state(), none;
  EXPECT_EQ(carry.at(at(-1), none), nullptr) << "nothing yet";
  const RelativeState* now = carry.at(at(0), first);
  ASSERT_NE(now, nullptr);
  EXPECT_FALSE(now->extrapolated);
  EXPECT_TRUE(now->covariance.isApprox(first.covariance));
  const RelativeState* later = carry.at(at(0.6), none);
  ASSERT_NE(later, nullptr);
  EXPECT_TRUE(later->extrapolated);
  EXPECT_TRUE(later->T_r_k.translation().xyz.isApprox(Vec3(29.7, 1.12, -7.94), 1e-12));
  const Eigen::Quaterniond turned = so3_exp(0.6 * first.rate_r);
  EXPECT_LT(later->T_r_k.rotation().quaternion().angularDistance(turned), 1e-12);
}

TEST(NavCarry, GrowsAsStatedAndEndsInTime) {
  NavConfig config;
  config.carry_s = 1;
  config.carry_acceleration_mps2 = 0.4;
  config.carry_angular_acceleration_rps2 = 0.1;
  NavCarry carry(config);
  const RelativeState none;
  RelativeState far = state();
  far.T_r_k = {far.T_r_k.rotation(), Point<frame::R>(Vec3(60, 1, -8))};
  carry.at(at(0), far);
  const RelativeState* later = carry.at(at(0.5), none);
  ASSERT_NE(later, nullptr);
  EXPECT_NEAR(later->covariance(0, 0), 0.01 + 0.0125 * 0.0125, 1e-15);
  EXPECT_NEAR(later->covariance(5, 5), 0.01 + 0.05 * 0.05, 1e-15);
  EXPECT_NE(carry.at(at(0.99), none), nullptr);
  EXPECT_EQ(carry.at(at(1.01), none), nullptr);
}

TEST(NavCarry, OfANearThingItIsSureOnlyForAMomentUntilProven) {
  NavConfig config;
  config.carry_acceleration_mps2 = 0.4;
  NavCarry carry(config);
  const RelativeState none;
  RelativeState near = state();  // a hand's length away: 0.4 % of the range are 2.4 mm, which 0.4 m/s2 makes in 0.11 s
  near.T_r_k = {near.T_r_k.rotation(), Point<frame::R>(Vec3(0.6, 0, 0))};
  near.velocity_r = near.rate_r = Vec3::Zero();
  carry.at(at(0), near);
  EXPECT_NE(carry.at(at(0.1), none), nullptr);
  EXPECT_EQ(carry.at(at(0.12), none), nullptr);
  carry.at(at(1), near);  // as foretold
  EXPECT_NE(carry.at(at(1.5), none), nullptr);
}

TEST(NavCarry, IsOffWithZeroSeconds) {
  NavConfig config;
  config.carry_s = 0;
  NavCarry carry(config);
  const RelativeState none;
  EXPECT_NE(carry.at(at(0), state()), nullptr) << "an update is itself";
  EXPECT_EQ(carry.at(at(0.033), none), nullptr);
}

TEST(NavCarry, SaysWhereTheSameUpdateWasAFrameBefore) {
  NavConfig config;
  NavCarry carry(config);
  const RelativeState first = state(), none;
  EXPECT_EQ(carry.before(at(0)), nullptr) << "nothing yet";
  carry.at(at(0), first);
  const RelativeState* then = carry.before(at(-0.1));
  ASSERT_NE(then, nullptr);
  EXPECT_TRUE(then->T_r_k.translation().xyz.isApprox(Vec3(30.05, 0.98, -8.01), 1e-12));
  EXPECT_EQ(then->t, at(-0.1));
  carry.at(at(0.6), none);
  EXPECT_NEAR(carry.age(at(0.6)).seconds(), 0.6, 1e-12);
  then = carry.before(at(0.5));
  ASSERT_NE(then, nullptr);
  EXPECT_TRUE(then->T_r_k.translation().xyz.isApprox(Vec3(29.75, 1.1, -7.95), 1e-12)) << "half a second after the update, not before this frame's";
  EXPECT_EQ(carry.at(at(9), none), nullptr);
  EXPECT_EQ(carry.before(at(8.9)), nullptr) << "too long ago";
}

TEST(NavCarry, OfASourceWhoseVelocityIsNotThatOfItsPlaceThereIsNoBefore) {
  NavCarry carry(NavConfig{});
  RelativeState s = state();
  s.velocity_r = Vec3::Zero();  // left at zero while the place goes on at 1 m/s
  for (int n = 0; n <= 60; ++n) {
    s.T_r_k = {s.T_r_k.rotation(), Point<frame::R>(Vec3(30 - n / 30.0, 1, -8))};
    ASSERT_NE(carry.at(at(n / 30.0), s), nullptr) << "the update itself is used";
  }
  EXPECT_EQ(carry.before(at(59 / 30.0)), nullptr);
}

}  // namespace
}  // namespace cyclops
