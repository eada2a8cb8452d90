// The worked numbers of spec 2.6.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "test/support.hpp"
#include "test/track/rig.hpp"

namespace cyclops {
namespace {

using test::thesis;
using test::TrackRig;

/// Measured 100, 101, 103, miss, 106, 108 from x = 100 at rest; predictions for the next frame, in u and (mirrored) in v.
void expect_six_frames(double alpha, double beta, const std::array<double, 6>& want, double final_v_px_s) {
  TrackRig rig(thesis(Filter::kAlphaBeta, alpha, beta));
  rig.begin();
  rig.nav({{100, 900}});
  const double z[6] = {100, 101, 103, -1, 106, 108};
  for (int n = 0; n < 6; ++n) {
    if (z[n] < 0) rig.miss(); else rig.hit({z[n], 1000 - z[n]});
    if (n == 5) { EXPECT_NEAR(rig.track().velocity_px_s.x(), final_v_px_s, 1e-5); }
    rig.begin();
    EXPECT_NEAR(rig.track().uv_px.x(), want[static_cast<std::size_t>(n)], 1e-6) << n;
    EXPECT_NEAR(rig.track().uv_px.y(), 1000 - want[static_cast<std::size_t>(n)], 1e-6) << n;
  }
}

TEST(Filter, FollowsTheSixFramesOfTheSpecificationWithBothGainSets) {
  expect_six_frames(0.7, 0.075, {100, 100.775, 102.574375, 102.81625, 105.525531, 107.923901}, 19.987242);
  expect_six_frames(0.9, 0.25, {100, 101.15, 103.5275, 104.24, 106.9765, 109.306025}, 42.251250);
}

/// Corners on a 1.22 px/frame ramp after which every prediction is within 0.1 px.
int frames_to_settle(double alpha, double beta) {
  TrackRig rig(thesis(Filter::kAlphaBeta, alpha, beta));
  rig.begin();
  rig.nav({{100, 100}});
  rig.hit({100, 100});
  int last_bad = 0;
  for (int n = 1; n <= 60; ++n) {
    rig.begin();
    const double z = 100 + 1.22 * n;
    if (std::fabs(z - rig.track().uv_px.x()) >= 0.1) last_bad = n;
    rig.hit({z, 100});
  }
  return last_bad;
}

TEST(Filter, SettlesOnARampAfterTwentyFiveOrEightFrames) {
  EXPECT_EQ(frames_to_settle(0.7, 0.075), 25);
  EXPECT_EQ(frames_to_settle(0.9, 0.25), 8);
}

struct Noise {
  double updated, predicted, velocity_t2;
};

/// Variances of a filter on a feature at rest with corners of unit variance, by simulation.
Noise simulated_noise(double alpha, double beta) {
  TrackRig rig(thesis(Filter::kAlphaBeta, alpha, beta));
  test::Random random(31);
  std::normal_distribution<double> noise;
  rig.begin();
  rig.nav({{500, 500}});
  rig.hit({500, 500});
  Noise sum{};
  constexpr int kSettle = 200, kFrames = 60000;
  const double T = test::kFrame.seconds();
  for (int n = 0; n < kSettle + kFrames; ++n) {
    rig.begin();
    const Vec2 before = rig.track().uv_px - Vec2(500, 500);
    rig.hit({500 + noise(random), 500 + noise(random)}, 1);
    if (n < kSettle) continue;
    sum.updated += (rig.track().uv_px - Vec2(500, 500)).squaredNorm() / (2 * kFrames);
    sum.predicted += before.squaredNorm() / (2 * kFrames);
    sum.velocity_t2 += rig.track().velocity_px_s.squaredNorm() * T * T / (2 * kFrames);
  }
  return sum;
}

TEST(Filter, HasTheNoiseGainsOfTheSpecificationInSimulation) {
  const Noise slow = simulated_noise(0.7, 0.075), fast = simulated_noise(0.9, 0.25);
  EXPECT_NEAR(slow.updated, 0.5502, 0.01);
  EXPECT_NEAR(slow.predicted, 0.6690, 0.01);
  EXPECT_NEAR(slow.velocity_t2, 0.006365, 0.0002);
  EXPECT_NEAR(fast.updated, 0.8234, 0.01);
  EXPECT_NEAR(fast.predicted, 1.3362, 0.02);
  EXPECT_NEAR(fast.velocity_t2, 0.071225, 0.002);
}

/// The covariance a track carries must arrive at the same gains when nothing accelerates.
TEST(Filter, TrackCovarianceSettlesAtTheNoiseGains) {
  for (const auto& [alpha, beta, updated, predicted] : {std::array{0.7, 0.075, 0.5502, 0.6690}, std::array{0.9, 0.25, 0.8234, 1.3362}}) {
    TrackConfig config = thesis(Filter::kAlphaBeta, alpha, beta);
    config.acceleration_px2_s3 = 0;
    TrackRig rig(config);
    rig.begin();
    rig.nav({{500, 500}});
    for (int n = 0; n < 400; ++n) {
      rig.hit({500, 500}, 2);
      rig.begin();
    }
    EXPECT_NEAR(rig.track().cov_px2(0, 0) / 4, predicted, 5e-5);
    rig.hit({500, 500}, 2);
    EXPECT_NEAR(rig.track().cov_px2(0, 0) / 4, updated, 5e-5);
    EXPECT_NEAR(rig.track().cov_px2(0, 1), 0, 1e-12);
  }
}

// Steady lag for an acceleration of a px/frame^2: 13.33 a and 4.0 a.
TEST(Filter, LagsAnAccelerationByTheSteadyErrorOfTheSpecification) {
  for (const auto& [alpha, beta, lag] : {std::array{0.7, 0.075, 13.333}, std::array{0.9, 0.25, 4.0}}) {
    TrackRig rig(thesis(Filter::kAlphaBeta, alpha, beta));
    rig.begin();
    rig.nav({{100, 500}});
    constexpr double a = 0.02;
    double error = 0;
    for (int n = 0; n < 250; ++n) {
      const double z = 100 + 0.5 * a * n * n;
      error = z - rig.track().uv_px.x();
      rig.hit({z, 500});
      rig.begin();
    }
    EXPECT_NEAR(error / a, lag, 0.01);
  }
}

TEST(Filter, ZeroOrderHoldPredictsTheLastCorner) {
  TrackRig rig(thesis(Filter::kZoh));
  rig.begin();
  rig.nav({{100, 100}});
  rig.hit({103, 98});
  rig.begin();
  EXPECT_EQ(rig.track().uv_px, Vec2(103, 98));
  EXPECT_EQ(rig.track().velocity_px_s, Vec2(0, 0));
}

// Errata E16.
TEST(Filter, AlphaOneBetaZeroEqualsZeroOrderHoldOnlyWhileTheVelocityIsZero) {
  TrackRig zoh(thesis(Filter::kZoh)), unit(thesis(Filter::kAlphaBeta, 1, 0));
  for (TrackRig* rig : {&zoh, &unit}) {
    rig->begin();
    rig->nav({{100, 100}});
    rig->hit({101, 100});
    rig->begin();
    rig->hit({104, 100});
    rig->begin();
  }
  EXPECT_EQ(zoh.track().uv_px, unit.track().uv_px);
  for (TrackRig* rig : {&zoh, &unit}) {  // a second navigation update gives the alpha-beta filter a velocity
    rig->nav({{110, 100}});
    rig->hit({104, 100});
    rig->begin();
  }
  EXPECT_DOUBLE_EQ(zoh.track().uv_px.x(), 104);
  EXPECT_NEAR(unit.track().uv_px.x(), 104 + 10.0 / 2, 1e-6) << "10 px in two frames";
}

TEST(Filter, UsesTheActualIntervalWhenFramesAreLost) {
  TrackRig rig(thesis(Filter::kAlphaBeta));
  rig.begin();
  rig.nav({{100, 100}});
  rig.hit({100, 100});
  for (int n = 1; n <= 100; ++n) { rig.begin(); rig.hit({100 + 2.0 * n, 100}); }
  rig.begin(test::kFrame * 3);
  EXPECT_NEAR(rig.track().uv_px.x(), 306, 0.05);
  rig.hit({306, 100});
  EXPECT_NEAR(rig.track().velocity_px_s.x(), 60, 0.5);
}

TEST(Filter, AFrameThatIsNotLaterMovesNothingAndIsCounted) {
  TrackRig rig(thesis(Filter::kAlphaBeta));
  rig.begin();
  rig.nav({{100, 100}});
  rig.hit({110, 100});
  rig.begin(Duration{0});
  rig.hit({120, 100});
  EXPECT_TRUE(rig.track().uv_px.allFinite());
  EXPECT_EQ(rig.track().velocity_px_s, Vec2(0, 0));
  EXPECT_EQ(rig.counters().late_frames, 1U);
}

TEST(Filter, UncertaintyGrowsWhileCoastingAndShrinksWithAHit) {
  for (const Filter filter : {Filter::kZohScore, Filter::kAlphaBeta, Filter::kKalman}) {
    TrackConfig config;
    config.filter = filter;
    TrackRig rig(config);
    rig.begin();
    rig.nav({{100, 100}});
    for (int n = 0; n < 20; ++n) { rig.hit({100, 100}); rig.begin(); }
    const double before = rig.track().cov_px2(0, 0);
    EXPECT_GT(before, 0.1);
    EXPECT_LT(before, 4);
    rig.miss();
    rig.begin();
    const double coasted = rig.track().cov_px2(0, 0);
    EXPECT_GT(coasted, before);
    rig.hit({100, 100});
    EXPECT_LT(rig.track().cov_px2(0, 0), before);
  }
}

TEST(Filter, AStartByNavigationThatIsOffGivesNoFalseVelocity) {
  TrackConfig config;
  config.filter = Filter::kAlphaBeta;
  TrackRig rig(config);
  rig.begin();
  rig.nav({{100, 100}});
  rig.hit({112, 95});
  EXPECT_EQ(rig.track().uv_px, Vec2(112, 95));
  EXPECT_EQ(rig.track().velocity_px_s, Vec2(0, 0));
  rig.begin();
  rig.hit({113, 95});
  EXPECT_NEAR(rig.track().velocity_px_s.x(), 0.075 * 30, 1e-5);
}

}  // namespace
}  // namespace cyclops
