#include "segment/segment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "test/support.hpp"

namespace cyclops {
namespace {

Vec2 at(double row, double column) { return {column, row}; }

SubImageSet segment(const SegmentConfig& config, const std::vector<Vec2>& points, int width = 1024, int height = 1024) {
  auto segmenter = std::make_unique<Segmenter>(config);
  SubImageSet out;
  segmenter->segment(points, width, height, out);
  return out;
}

SegmentConfig linked_at(double link_px) {
  SegmentConfig c;
  c.link_px = link_px;
  return c;
}

int area(const SubImageSet& boxes) {
  int n = 0;
  for (const SubImage& b : boxes) n += b.width * b.height;
  return n;
}

void expect_box(const SubImage& b, int row0, int row1, int column0, int column1, int features) {
  EXPECT_EQ(b.v0, row0);
  EXPECT_EQ(b.v0 + b.height - 1, row1);
  EXPECT_EQ(b.u0, column0);
  EXPECT_EQ(b.u0 + b.width - 1, column1);
  EXPECT_EQ(b.features, features);
}

bool same(const SubImageSet& a, const SubImageSet& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const SubImage& x, const SubImage& y) {
    return x.u0 == y.u0 && x.v0 == y.v0 && x.width == y.width && x.height == y.height && x.features == y.features;
  });
}

/// Clusters by their definition, no cleverness: grow from a seed until nothing is close.
SubImageSet by_definition(const SegmentConfig& config, std::vector<Vec2> points, int width, int height) {
  SubImageSet out;
  while (!points.empty()) {
    std::vector<Vec2> cluster{points.back()};
    points.pop_back();
    for (std::size_t i = 0; i < cluster.size(); ++i)
      for (std::size_t j = 0; j < points.size();)
        if ((points[j] - cluster[i]).squaredNorm() < config.link_px * config.link_px) {
          cluster.push_back(points[j]);
          points.erase(points.begin() + static_cast<std::ptrdiff_t>(j));
        } else {
          ++j;
        }
    Vec2 low = cluster[0], high = cluster[0];
    for (const Vec2& p : cluster) low = low.cwiseMin(p), high = high.cwiseMax(p);
    const int b = config.buffer_px, u0 = std::max(0, int(std::floor(low.x())) - b), v0 = std::max(0, int(std::floor(low.y())) - b);
    out.push_back({u0, v0, std::min(width - 1, int(std::ceil(high.x())) + b) - u0 + 1,
                   std::min(height - 1, int(std::ceil(high.y())) + b) - v0 + 1, int(cluster.size())});
  }
  std::sort(out.begin(), out.end(), [](const SubImage& a, const SubImage& b) { return a.v0 != b.v0 ? a.v0 < b.v0 : a.u0 < b.u0; });
  return out;
}

const std::vector<Vec2> kSpecPoints{at(200, 200), at(200, 235), at(225, 262), at(400, 400), at(400, 460), at(10, 700)};

TEST(Segment, GivesTheSpecsBoxesAndAreaAtThreshold61) {
  const auto boxes = segment(linked_at(61), kSpecPoints);
  ASSERT_EQ(boxes.size(), 3U);
  expect_box(boxes[0], 0, 40, 670, 730, 1);
  expect_box(boxes[1], 170, 255, 170, 292, 3);
  expect_box(boxes[2], 370, 430, 370, 490, 2);
  EXPECT_EQ(area(boxes), 20460);
  EXPECT_NEAR(100.0 * area(boxes) / (1024 * 1024), 1.951, 0.0005);
}

TEST(Segment, LinksStrictlyBelowTheThreshold) {
  // GIVEN two points exactly 60 px apart WHEN the threshold is 40 or 60 THEN they stay apart
  for (double link : {40.0, 60.0}) {
    SegmentConfig config = linked_at(link);
    config.merge_overlapping = false;
    EXPECT_EQ(segment(config, kSpecPoints).size(), 4U) << link;
  }
}

TEST(Segment, MergesBoxesThatShareAPixelSoThatNoCornerIsFoundTwice) {
  // GIVEN the same two points at threshold 60: boxes of 61 px share one column THEN they become one box
  const auto boxes = segment(linked_at(60), kSpecPoints);
  ASSERT_EQ(boxes.size(), 3U);
  expect_box(boxes[2], 370, 430, 370, 490, 2);
}

TEST(Segment, MergingRunsUntilNothingOverlaps) {
  // GIVEN a long diagonal cluster whose box covers two others that do not touch it as clusters
  std::vector<Vec2> points;
  for (int i = 0; i <= 10; ++i) points.push_back(at(200 + 40 * i, 200 + 40 * i));
  points.push_back(at(220, 560));
  points.push_back(at(150, 640));  // touches the box of the one above only
  SegmentConfig config;
  EXPECT_EQ(segment(config, points).size(), 1U);
  config.merge_overlapping = false;
  EXPECT_EQ(segment(config, points).size(), 3U);
}

TEST(Segment, ElevenSingleBoxesCoverTheThesis3Point9Percent) {
  std::vector<Vec2> points;
  for (int i = 0; i < 11; ++i) points.push_back(at(100 + 200 * (i / 4), 100 + 200 * (i % 4)));
  const auto boxes = segment(SegmentConfig{}, points);
  ASSERT_EQ(boxes.size(), 11U);
  EXPECT_NEAR(100.0 * area(boxes) / (1024 * 1024), 3.90, 0.005);
}

TEST(Segment, IgnoresPointsOutsideTheImageAndNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto boxes = segment(SegmentConfig{}, {at(-0.6, 50), at(50, 1023.5), at(nan, 5), at(5, inf), at(-1e300, 1e300), at(1023.4, -0.5)});
  ASSERT_EQ(boxes.size(), 1U);
  expect_box(boxes[0], 993, 1023, 0, 30, 1);
  EXPECT_TRUE(segment(SegmentConfig{}, {}).empty());
}

TEST(Segment, CoversTheBufferAroundAFractionalPoint) {
  const auto boxes = segment(SegmentConfig{}, {at(100.25, 200.75)});
  expect_box(boxes[0], 70, 131, 170, 231, 1);
}

TEST(Segment, DoesNotDependOnTheOrderOfThePoints) {
  test::Random random(1);
  std::uniform_real_distribution<double> place(-20, 1044);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Vec2> points(5 + 4 * static_cast<std::size_t>(trial));
    for (Vec2& p : points) p = {place(random), place(random)};
    const auto first = segment(linked_at(40), points);
    for (int shuffle = 0; shuffle < 5; ++shuffle) {
      std::shuffle(points.begin(), points.end(), random);
      EXPECT_TRUE(same(segment(linked_at(40), points), first));
    }
  }
}

TEST(Segment, AgreesWithTheDefinitionOnRandomPoints) {
  test::Random random(2);
  std::uniform_real_distribution<double> place(0, 1000);
  for (int trial = 0; trial < 200; ++trial) {
    SegmentConfig config = linked_at(1 + 0.5 * trial);
    config.merge_overlapping = false;
    config.buffer_px = trial % 40;
    std::vector<Vec2> points(1 + static_cast<std::size_t>(trial));
    for (Vec2& p : points) p = {place(random), trial % 2 == 0 ? place(random) : 0.1 * place(random)};
    EXPECT_TRUE(same(segment(config, points), by_definition(config, points, 1024, 1024))) << trial;
  }
}

TEST(Segment, ResultIsDisjointAndHoldsEveryPointWithItsBuffer) {
  test::Random random(3);
  std::uniform_real_distribution<double> place(0, 4095);
  std::vector<Vec2> points(kMaxFeatures);
  for (Vec2& p : points) p = {place(random), place(random)};
  const auto boxes = segment(SegmentConfig{}, points, 4096, 4096);
  int features = 0;
  for (const SubImage& a : boxes) {
    features += a.features;
    for (const SubImage& b : boxes)
      EXPECT_TRUE(&a == &b || a.u0 + a.width <= b.u0 || b.u0 + b.width <= a.u0 || a.v0 + a.height <= b.v0 || b.v0 + b.height <= a.v0);
  }
  EXPECT_EQ(features, static_cast<int>(kMaxFeatures));
}

TEST(Segment, UsesNoHeap) {
  auto segmenter = std::make_unique<Segmenter>(SegmentConfig{});
  auto out = std::make_unique<SubImageSet>();
  test::HeapGuard guard;
  segmenter->segment(kSpecPoints, 1024, 1024, *out);
  EXPECT_EQ(guard.count(), 0U);
}

TEST(SegmentConfig, RequiresRoomForGateBorderAndSuppression) {
  EXPECT_TRUE(check_buffer(SegmentConfig{}, 13, 5, 3).ok());
  EXPECT_TRUE(check_buffer(SegmentConfig{}, 21, 5, 3).ok());
  const auto refused = check_buffer(SegmentConfig{}, 22, 5, 3);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message(), "segment.buffer_px: is 30, expected at least gate + border + NMS radius + 1 = 31");
}

TEST(SegmentConfig, LinkFollowsTheBufferUnlessGiven) {
  auto file = ConfigFile::parse("[segment]\nbuffer_px = 40\n", "a.toml").value();
  auto table = file.root().table("segment");
  const auto config = SegmentConfig::read(table, {}).value();
  EXPECT_EQ(config.buffer_px, 40);
  EXPECT_EQ(config.link_px, 81);
  EXPECT_TRUE(file.finish().ok());
}

}  // namespace
}  // namespace cyclops
