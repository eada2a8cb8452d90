#include "flow/flow_finder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "test/patch/look_scene.hpp"

namespace cyclops {
namespace {

using test::CameraPose;
using test::Paint;
using test::Plate;

/// Blots and grain, nowhere the same twice.
double painted(double y, double z) { return 0.5 * (test::blots(y, z) + test::grain(y, z)); }
double clutter(double u, double v) { return 110 + 60 * std::sin(0.31 * u + 2 * std::sin(0.11 * v)) + 50 * std::cos(0.23 * v - 0.17 * u); }
/// A board of squares, 0.5 m each.
double chequered(double y, double z) { return (static_cast<int>(std::floor(2 * y)) + static_cast<int>(std::floor(2 * z))) % 2 == 0 ? 200 : 40; }

class FlowFinderTest : public ::testing::Test {
 protected:
  /// The six features of the plate and twelve more within it.
  FlowFinderTest() {
    std::string csv = "id,x,y,z,sigma\n1,0,-2,2,0\n2,0,2,2,0\n3,0,2,-2,0\n4,0,-2,-2,0\n5,0,0.3,0.5,0\n6,0,-0.7,-0.6,0\n";
    for (int i = 0; i < 12; ++i)
      csv += std::to_string(7 + i) + ",0," + std::to_string(-1.4 + 0.9 * (i % 4)) + "," + std::to_string(-1.3 + 1.2 * (i / 4)) + ",0\n";
    plate.model = TankerModel::parse(csv, "plate", 1, Vec3::Zero()).value();
  }
  /// Learns from `then`, of features up to `measured`.
  void learn(const CameraPose& then, const Paint& paint, std::size_t measured = 18) {
    plate.predict(then, 1, *predicted);
    MeasurementSet set;
    for (std::size_t i = 0; i < measured; ++i) {
      Measurement m;
      m.feature = static_cast<std::uint16_t>(i);
      m.accepted = true;
      set.items.push_back(m);
    }
    finder.learn(plate.draw(then, paint, clutter, 1), nullptr, *predicted, set);
  }
  /// Looks for them at `now` where `expected` puts them.
  const LandmarkSet& find(const CameraPose& now, const CameraPose& expected, const Paint& paint) {
    plate.predict(expected, 1, *predicted);
    return finder.find(plate.draw(now, paint, clutter, 2), nullptr, *predicted);
  }
  double worst_px(const LandmarkSet& marks, const CameraPose& now) const {
    double worst = 0;
    for (const Landmark& m : marks) worst = std::max(worst, (m.uv_px - plate.at(now, m.feature)).norm());
    return worst;
  }

  Plate plate;
  FlowFinder finder{FlowConfig{}};
  std::unique_ptr<PredictionSet> predicted = std::make_unique<PredictionSet>();
  CameraPose then = Plate::pose({0.1, -0.1, 0.05}, {0, -0.1, 9});
  CameraPose now = Plate::pose({0.1, -0.1, 0.10}, {0.6, 0.25, 8.8});  // 20 px to the right, 12 px down, 3 degrees about the line of sight
};

TEST_F(FlowFinderTest, FindsAMotionThatNothingHasPredicted) {
  learn(then, painted);
  const LandmarkSet& marks = find(now, then, painted);
  ASSERT_GE(marks.size(), 10U);
  ASSERT_GT((plate.at(now, 0) - plate.at(then, 0)).norm(), 15);
  EXPECT_LT(worst_px(marks, now), 2.0);
}

TEST_F(FlowFinderTest, TheErrorOfAPlaceIsWhatItsCovarianceSays) {
  learn(then, painted);
  double sum = 0;
  int n = 0;
  for (int k = 0; k < 12; ++k) {
    const CameraPose there = Plate::pose({0.1, -0.1, 0.05 + 0.01 * (k % 3)}, {0.5 * std::cos(k), 0.4 * std::sin(k), 9 - 0.03 * k});
    for (const Landmark& m : find(there, then, painted)) {
      const Vec2 e = m.uv_px - plate.at(there, m.feature);
      sum += e.dot(m.cov_px2.inverse() * e) / 2;
      ++n;
    }
  }
  ASSERT_GE(n, 100);
  EXPECT_LT(sum / n, 1.5);
  EXPECT_GT(sum / n, 0.1);
}

TEST_F(FlowFinderTest, WhatStandsStillBehindTheGroupIsNotItsMotion) {
  // GIVEN a plate that slides before a background, and which a step shows from its rim on
  learn(then, test::blots);
  const LandmarkSet& marks = find(now, then, test::blots);
  ASSERT_FALSE(marks.empty());
  EXPECT_LT(worst_px(marks, now), 4.0);
}

TEST_F(FlowFinderTest, APatternThatRepeatsGivesNothing) {
  learn(then, chequered, 18);
  EXPECT_TRUE(find(Plate::pose({0.1, -0.1, 0.05}, {0.5, -0.1, 9}), then, chequered).empty());
}

TEST_F(FlowFinderTest, AnotherPictureGivesNothing) {
  learn(then, painted);
  EXPECT_TRUE(find(now, then, [](double y, double z) { return painted(3 - 2 * z, 5 + 2 * y); }).empty());
}

TEST_F(FlowFinderTest, LooksAgainWhereFeaturesAreExpectedSinceTheyNeedNotMoveAlike) {
  // GIVEN a turn about the line of sight by 9 degrees: the corners move 20 px apart
  const CameraPose turned = Plate::pose({0.1, -0.1, 0.05 + 0.157}, {0.3, -0.1, 9});
  learn(then, painted);
  const std::size_t first = find(turned, then, painted).size();
  // WHEN the turn is known but for a little
  plate.predict(Plate::pose({0.1, -0.1, 0.05 + 0.14}, {0.28, -0.1, 9}), 1, *predicted);
  const LandmarkSet& marks = finder.find_again(*predicted);
  EXPECT_GT(marks.size(), first);
  EXPECT_LT(worst_px(marks, turned), 4.0);
}

TEST_F(FlowFinderTest, RemembersWhatWasNotMeasuredForSomeFrames) {
  learn(then, painted);
  const std::size_t all = find(now, then, painted).size();
  for (int k = 0; k < 4; ++k) learn(then, painted, 6);
  EXPECT_GE(find(now, then, painted).size(), all - 1);
  for (int k = 0; k < 4; ++k) learn(then, painted, 6);
  EXPECT_LT(find(now, then, painted).size(), all - 4);
}

TEST_F(FlowFinderTest, TwelveBitsAreTheSame) {
  learn(then, painted);
  plate.predict(then, 1, *predicted);
  const ImageView image = plate.draw(now, painted, clutter, 2);
  const LandmarkSet in8 = finder.find(image, nullptr, *predicted);
  std::vector<std::uint16_t> deep;
  for (const std::uint8_t p : plate.pixels) deep.push_back(static_cast<std::uint16_t>(p << 4));
  const ImageView image12{reinterpret_cast<const std::uint8_t*>(deep.data()), image.width, image.height, 2 * image.width, PixelFormat::kMono12};
  const LandmarkSet in12 = finder.find(image12, nullptr, *predicted);
  ASSERT_EQ(in8.size(), in12.size());
  for (std::size_t i = 0; i < in8.size(); ++i) EXPECT_EQ(in8[i].uv_px, in12[i].uv_px);
}

TEST_F(FlowFinderTest, MissingRowsAndPicturesAndPlacesOutsideAreNoHarm) {
  learn(then, painted);
  plate.predict(then, 1, *predicted);
  const ImageView image = plate.draw(now, painted, clutter, 2);
  RowMask some, all;
  for (int v = 0; v < image.height; ++v) {
    if (v % 7 == 0) some.set_missing(v);
    all.set_missing(v);
  }
  const LandmarkSet& marks = finder.find(image, &some, *predicted);
  EXPECT_GE(marks.size(), 8U);
  EXPECT_LT(worst_px(marks, now), 2.5);
  EXPECT_TRUE(finder.find(image, &all, *predicted).empty());
  EXPECT_TRUE(finder.find({}, nullptr, *predicted).empty());
  for (const double off : {-400.0, 400.0, 1e15}) {
    plate.predict(then, 1, *predicted);
    for (Prediction& p : predicted->items) {
      p.uv_px += Vec2(off, off);
      p.visibility = Visibility::kOutsideImage;
    }
    EXPECT_TRUE(finder.find(image, nullptr, *predicted).empty()) << off;
  }
  plate.predict(then, 1, *predicted);
  ASSERT_FALSE(finder.find(image, nullptr, *predicted).empty());
  for (Prediction& p : predicted->items) p.uv_px = {p.feature % 2 == 0 ? 0 : 319, 239};  // anywhere: the rim, and far from where it was looked for
  finder.find_again(*predicted);
  FlowFinder off{FlowConfig{.enabled = false}};
  plate.predict(then, 1, *predicted);
  EXPECT_TRUE(off.find(image, nullptr, *predicted).empty());
}

TEST_F(FlowFinderTest, UsesNoHeap) {
  learn(then, painted);
  plate.predict(then, 1, *predicted);
  const ImageView image = plate.draw(now, painted, clutter, 2);
  MeasurementSet measured;
  for (std::uint16_t i = 0; i < 18; ++i) measured.items.push_back({.feature = i, .accepted = true});
  const test::HeapGuard guard;
  finder.find(image, nullptr, *predicted);
  finder.find_again(*predicted);
  finder.learn(image, nullptr, *predicted, measured);
  EXPECT_EQ(guard.count(), 0U);
}

}  // namespace
}  // namespace cyclops
