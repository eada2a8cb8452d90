// From views to points: each step on a scene whose points are known, then all of them together.
#include "tools/learn.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include "test/tools/learn_scene.hpp"
#include "tools/learn_cost.hpp"

namespace cyclops {
namespace {

using test::LearnScene;
namespace learn = tools::learn;

double normalised(const Vec3& error, const Mat3& cov) { return error.dot(cov.ldlt().solve(error)); }

/// Largest difference between the Jacobians of a residual and central differences, over all its parameters.
double jacobian_error(const ceres::CostFunction& cost, std::vector<std::vector<double>> at) {
  const auto rows = static_cast<std::size_t>(cost.num_residuals());
  std::vector<std::vector<double>> jacobians;
  std::vector<double*> in, out;
  for (auto& block : at) jacobians.emplace_back(rows * block.size());
  for (std::size_t b = 0; b < at.size(); ++b) in.push_back(at[b].data()), out.push_back(jacobians[b].data());
  std::vector<double> r(rows), above(rows), below(rows);
  EXPECT_TRUE(cost.Evaluate(in.data(), r.data(), out.data()));
  double worst = 0;
  for (std::size_t b = 0; b < at.size(); ++b)
    for (std::size_t k = 0; k < at[b].size(); ++k) {
      const double here = at[b][k], h = 1e-6;
      at[b][k] = here + h;
      cost.Evaluate(in.data(), above.data(), nullptr);
      at[b][k] = here - h;
      cost.Evaluate(in.data(), below.data(), nullptr);
      at[b][k] = here;
      for (std::size_t i = 0; i < rows; ++i) {
        const double numeric = (above[i] - below[i]) / (2 * h);
        worst = std::max(worst, std::fabs(jacobians[b][i * at[b].size() + k] - numeric) / (1 + std::fabs(numeric)));
      }
    }
  return worst;
}

TEST(Learn, JacobiansOfTheResidualsAgreeWithNumericalOnes) {
  Intrinsics k;
  k.k1 = -0.1;
  const Camera camera(k, {});
  Mat6 C = Mat6::Identity();
  C(0, 4) = C(4, 0) = 0.4;
  const std::vector<double> change{0.3, -0.2, 0.1, 0.5, -0.4, 1}, point{1, -2, 0.5};
  EXPECT_LT(jacobian_error(learn::CornerCost(camera, LearnScene::pose_at(3, 40), {500, 480}, 0.3), {change, point}), 1e-6);
  EXPECT_LT(jacobian_error(learn::PosePrior(C), {change}), 1e-6);
  EXPECT_LT(jacobian_error(learn::SurveyTie(Point<frame::K>(1, 2, 3), 0.01), {point}), 1e-6);
}

TEST(Learn, TriangulationIsAsWrongAsItsCovarianceSays) {
  LearnScene scene(60);
  scene.pose_rad = scene.pose_m = 1e-9;  // poses are given here
  scene.fly(30);
  double chi2 = 0;
  const auto points = scene.matched(0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const learn::PointPrior prior{Point<frame::K>(points[i].p_k.xyz + Vec3(0.2, -0.3, 0.1)), Mat3::Identity()};
    const auto found = learn::triangulate(scene.views.views, points[i].sights, prior, 0);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->rms_px, scene.corner_px, 0.08);
    chi2 += normalised(found->p_k - scene.points[i], found->cov_m2);
  }
  EXPECT_GT(chi2, 137);  // 180 degrees of freedom: 1 % and 99 %
  EXPECT_LT(chi2, 229);
}

TEST(Learn, BundleAdjustmentRecoversThePlacesWithinTheirCovariance) {
  // GIVEN poses 2 mrad and 2 cm off, corners 0.2 px off, points that start 5 cm off, eight of them tied to a survey
  // WHEN all is adjusted together, in several scenes
  // THEN errors are as large as the covariances say, and far smaller than before
  double chi2 = 0, degrees = 0, error2 = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    LearnScene scene(25);
    scene.random.seed(seed);
    scene.fly(24);
    auto points = scene.matched(0.05);
    learn::BundleConfig config;
    config.robust_sigmas = 100;  // nothing here is an outlier: the loss would only make the covariance larger
    config.tie_sigma_px = 0;
    config.covariance = true;
    ASSERT_TRUE(learn::adjust(config, scene.views, points).ok());
    for (std::size_t i = 0; i < points.size(); ++i) {
      chi2 += normalised(points[i].p_k - scene.points[i], points[i].cov_m2);
      error2 += (points[i].p_k - scene.points[i]).squaredNorm();
      degrees += 3;
    }
  }
  EXPECT_GT(chi2 / degrees, 0.6);
  EXPECT_LT(chi2 / degrees, 1.5);  // the points of one scene share the error of the survey: wide bounds
  EXPECT_LT(std::sqrt(3 * error2 / degrees), 0.01);
}

TEST(Learn, ASurveyedPlaceThatIsAnotherPointLetsGo) {
  LearnScene scene(25);
  scene.fly(24);
  auto points = scene.matched(0.02);
  points[2].survey = 3;
  points[3].survey = -1;
  learn::BundleConfig config;
  ASSERT_TRUE(learn::adjust(config, scene.views, points).ok());
  EXPECT_LT((points[2].p_k - scene.points[2]).norm(), 0.02) << "tied to a feature metres away";
}

TEST(Learn, FindsThePointsOfTheTankerAmongClutter) {
  // GIVEN 40 points, views with 10 corners each that belong to nothing, and poses a few tenths of a pixel off
  // WHEN all steps run
  // THEN nearly all points are found, within their covariance, and nothing else is
  LearnScene scene(40);
  scene.pose_rad = 5e-4;
  scene.pose_m = 5e-3;
  scene.fly(45);
  std::size_t followed = 0;
  const auto chosen = learn::learn_points(scene.views, {}, followed);
  ASSERT_TRUE(chosen.ok()) << chosen.error().message();
  std::size_t right = 0;
  double chi2 = 0;
  for (const learn::ChosenPoint& c : *chosen) {
    const auto error = [&](const Point<frame::K>& q) { return (q - c.point.p_k).norm(); };
    const auto nearest = std::min_element(scene.points.begin(), scene.points.end(), [&](const auto& a, const auto& b) { return error(a) < error(b); });
    if (error(*nearest) > 0.05) continue;
    ++right;
    chi2 += normalised(c.point.p_k - *nearest, c.point.cov_m2);
  }
  EXPECT_GE(right, 34U);
  EXPECT_EQ(right, chosen->size()) << "a point that is none";
  EXPECT_LT(chi2 / static_cast<double>(right), 6) << "3 is expected, inflation makes it less";
}

TEST(Learn, APointWhoseCornersDoNotTellItsDistanceIsLeftOut) {
  // GIVEN a spot that is seen for 12 views in which the camera does not move: it may be anywhere on one line
  // WHEN all steps run
  // THEN it is left out, and said to be; all others have a covariance
  LearnScene scene(20);
  scene.pose_rad = scene.pose_m = 1e-9;
  scene.clutter = 0;
  scene.fly(30);
  for (int i = 0; i < 12; ++i) {
    learn::View still = scene.views.views[10];
    for (learn::SeenCorner& c : still.corners) c.uv_px += Vec2(scene.normal(0.1), scene.normal(0.1));
    still.corners.push_back({Vec2(500 + scene.normal(0.1), 520 + scene.normal(0.1)), Mat2::Identity() * 0.01, LearnScene::patch_of(77)});
    scene.views.views.push_back(std::move(still));
  }
  std::size_t followed = 0;
  std::string words;
  const auto chosen = learn::learn_points(scene.views, {}, followed, [&](const std::string& text) { words += text + "\n"; });
  ASSERT_TRUE(chosen.ok()) << chosen.error().message();
  EXPECT_EQ(followed, 21U);
  EXPECT_EQ(chosen->size(), 20U);
  EXPECT_NE(words.find("left out: "), std::string::npos) << words;
}

TEST(Learn, NothingToLearnIsAnErrorThatSaysSo) {
  LearnScene scene(0);
  scene.points.emplace_back(0, 0, 0);
  scene.fly(12);
  for (learn::View& v : scene.views.views) v.corners.clear();
  std::size_t followed = 0;
  const auto chosen = learn::learn_points(scene.views, {}, followed);
  ASSERT_FALSE(chosen.ok());
  EXPECT_EQ(chosen.error().message(), "follow: found no point in 12 views, expected some that are seen often");
}

TEST(Learn, APointThatSlidesShowsDriftAndIsNotChosen) {
  // GIVEN a corner where two outlines cross: its place on the tanker moves by 20 cm in the course of the flight
  LearnScene scene(12);
  scene.pose_rad = scene.pose_m = 1e-9;
  scene.fly(40);
  auto points = scene.matched(0);
  for (const learn::Sight& s : points[5].sights) {
    auto& view = scene.views.views[static_cast<std::size_t>(s.view)];
    view.corners[static_cast<std::size_t>(s.corner)].uv_px += Vec2(0.1 * (s.view - 20), 0);
  }
  for (learn::LearntPoint& p : points) {
    learn::rate(scene.views.views, p);
    p.cov_m2 = 1e-6 * Mat3::Identity();
  }
  EXPECT_GT(points[5].drift_px, 0.5);
  EXPECT_GT(points[5].inflation, 5);
  EXPECT_LT(points[4].drift_px, 0.15);
  const auto chosen = learn::choose({}, scene.views.views, points);
  EXPECT_EQ(chosen.size(), 11U);
}

TEST(Learn, APointIsOnlyExpectedFromWhereItWasSeen) {
  // GIVEN a point that is hidden in the first half of the flight, which is flown from further away
  LearnScene scene(12);
  scene.pose_rad = scene.pose_m = 1e-9;
  scene.fly(40);
  auto points = scene.matched(0);
  std::erase_if(points[0].sights, [](const learn::Sight& s) { return s.view < 20; });
  const SeenFrom sector = learn::sector_of(scene.views.views, points[0]);
  EXPECT_NEAR(points[0].strength, 1, 0.1) << "where it can be seen it always was";
  const auto range = [&](int v) { return (scene.poses[static_cast<std::size_t>(v)] * scene.points[0]).xyz.norm(); };
  EXPECT_LT(range(30), sector.most_m);
  EXPECT_GT(range(0), sector.most_m);
}

TEST(Learn, AStretchOfAFlightIsAFolderAndSeconds) {
  const auto part = learn::Stretch::parse("build/flights/s1@2.5-20");
  ASSERT_TRUE(part.ok());
  EXPECT_EQ(part->folder, "build/flights/s1");
  EXPECT_EQ(part->from_s, 2.5);
  EXPECT_EQ(part->to_s, 20);
  EXPECT_EQ(learn::Stretch::parse("s1").value().folder, "s1");
  for (const char* wrong : {"s1@", "s1@3", "s1@5-2", "s1@a-b", "s1@1-2x"})
    EXPECT_EQ(learn::Stretch::parse(wrong).error().message(),
              std::string(wrong) + ": stretch is \"" + std::string(wrong).substr(3) + "\", expected FROM-TO in seconds, as 0-20");
}

TEST(Learn, AFlightThatIsNotThereIsNamed) {
  const auto views = learn::views_of({{"/nowhere/flight"}}, {}, {});
  ASSERT_FALSE(views.ok());
  EXPECT_NE(views.error().message().find("/nowhere/flight"), std::string::npos) << views.error().message();
}

}  // namespace
}  // namespace cyclops
