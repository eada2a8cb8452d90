#include "align/acquire.hpp"

#include <gtest/gtest.h>

#include "test/support.hpp"

namespace cyclops {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

/// Fourteen features of an irregular object 25 m ahead of a camera; navigation puts it somewhere else.
class AcquireTest : public ::testing::Test {
 protected:
  AcquireTest() {
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(1, 4, .5), Vec3(-2, -4, 1), Vec3(3, 1, 2), Vec3(-1, 2.5, -1), Vec3(2, -3, -2), Vec3(-3, 1, .3), Vec3(.5, -1.5, 1.6),
                          Vec3(4, -2, .2), Vec3(-4, 3, 1.1), Vec3(1.5, 5, -.7), Vec3(-1.5, -5, .4), Vec3(2.5, 2.8, -1.4), Vec3(-2.6, -1.2, -1.8)})
      body.emplace_back(p);
    for (std::size_t i = 0; i < body.size(); ++i) {
      Prediction p;
      p.id = static_cast<FeatureId>(i + 1);
      p.feature = static_cast<std::uint16_t>(i);
      p.visibility = Visibility::kVisible;
      predicted->items.push_back(p);
    }
    truth = {Rotation<frame::C, frame::K>(so3_exp({1.1, -0.3, 0.4})), Point<frame::C>(0.8, -0.5, 25)};
    variance.assign(body.size(), 1.0);
  }
  align::Prior prior_off_by(const Vec3& turn, const Vec3& shift) const {
    align::Prior p;
    align::Vec6 d;
    d << turn, shift;
    p.T = align::moved(truth, d);
    p.P = Mat6::Zero();
    p.P.diagonal().head<3>().setConstant(std::pow(1.75 * kDeg, 2));
    p.P.diagonal().tail<3>().setConstant(2.9 * 2.9);
    p.valid = true;
    return p;
  }
  void see(int features, int clutter, std::uint64_t seed) {
    test::Random random(seed);
    std::uniform_real_distribution<double> u(20, 1000), noise(-0.4, 0.4);
    corners->items.clear();
    for (int i = 0; i < features; ++i) {
      Corner c;
      c.uv_px = *camera.project(truth * body[static_cast<std::size_t>(i)]) + Vec2(noise(random), noise(random));
      corners->items.push_back(c);
    }
    for (int i = 0; i < clutter; ++i) {
      Corner c;
      c.uv_px = {u(random), u(random)};
      corners->items.push_back(c);
    }
  }
  double worst_px(const align::CameraPose& pose) const {
    double worst = 0;
    for (const auto& p : body) worst = std::max(worst, (*camera.project(pose * p) - *camera.project(truth * p)).norm());
    return worst;
  }

  AlignConfig config{};
  Camera camera{};
  std::vector<Point<frame::K>> body;
  align::CameraPose truth{};
  std::vector<double> variance;
  std::unique_ptr<PredictionSet> predicted = std::make_unique<PredictionSet>();
  std::unique_ptr<CornerSet> corners = std::make_unique<CornerSet>();
};

TEST_F(AcquireTest, FindsATankerFiveMetresAndThreeDegreesAway) {
  align::Acquirer acquirer(config, camera, body);
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    test::Random random(seed);
    std::normal_distribution<double> n;
    const Vec3 turn = 3 * kDeg * Vec3(n(random), n(random), n(random)).normalized(), shift = 5 * Vec3(n(random), n(random), n(random)).normalized();
    see(11, 60, seed);
    const auto found = acquirer.search(prior_off_by(turn, shift), *predicted, *corners, variance, config.acquire_beam);
    ASSERT_TRUE(found) << seed;
    EXPECT_GE(found->found, 11) << seed;
    EXPECT_EQ(found->in_view, 14) << seed;
    EXPECT_LT(worst_px(found->pose.T), 3) << seed;
    EXPECT_GT(found->evidence, config.acquire_evidence) << seed;
    EXPECT_GT(found->margin, config.acquire_margin) << seed;
  }
}

TEST_F(AcquireTest, ClutterAloneIsNoTanker) {
  align::Acquirer acquirer(config, camera, body);
  for (std::uint64_t seed = 11; seed <= 16; ++seed) {
    see(0, 90, seed);
    const auto found = acquirer.search(prior_off_by({0.02, -0.03, 0.01}, {2, -1, 3}), *predicted, *corners, variance, config.acquire_beam);
    ASSERT_TRUE(found) << seed;
    EXPECT_LT(found->evidence, 0) << seed;
  }
}

TEST_F(AcquireTest, TheCovarianceThatIsLeftHoldsTheError) {
  align::Acquirer acquirer(config, camera, body);
  see(14, 40, 3);
  const auto found = acquirer.search(prior_off_by({0.02, 0.03, -0.02}, {-3, 2, 3}), *predicted, *corners, variance, config.acquire_beam);
  ASSERT_TRUE(found);
  const align::Vec6 gap = align::difference(found->pose.T, truth);
  EXPECT_LT(gap.dot(found->pose.P.ldlt().solve(gap)), 22.5);  // 99.9 % of chi-square, 6 degrees of freedom
  EXPECT_LT((found->pose.P.bottomRightCorner<3, 3>().trace()), 0.1);
}

TEST_F(AcquireTest, ASmallBeamLosesWhatALargeOneFinds) {
  align::Acquirer acquirer(config, camera, body);
  see(9, 150, 5);
  const auto prior = prior_off_by({0.03, -0.03, 0.03}, {3, 3, -2.5});
  const auto wide = acquirer.search(prior, *predicted, *corners, variance, config.acquire_beam);
  align::Acquirer again(config, camera, body);
  const auto narrow = again.search(prior, *predicted, *corners, variance, 1);
  ASSERT_TRUE(wide && narrow);
  EXPECT_LT(worst_px(wide->pose.T), 4);
  EXPECT_GT(wide->evidence, narrow->evidence);
}

TEST_F(AcquireTest, NothingSeenNothingExpected) {
  align::Acquirer acquirer(config, camera, body);
  corners->items.clear();
  EXPECT_FALSE(acquirer.search(prior_off_by({0, 0, 0}, {0, 0, 0}), *predicted, *corners, variance, 16));
  see(14, 0, 1);
  for (Prediction& p : predicted->items) p.visibility = Visibility::kHidden;
  EXPECT_FALSE(acquirer.search(prior_off_by({0, 0, 0}, {0, 0, 0}), *predicted, *corners, variance, 16));
}

}  // namespace
}  // namespace cyclops
