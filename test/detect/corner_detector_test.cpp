#include "detect/corner_detector.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>

#include "test/detect/images.hpp"

namespace cyclops {
namespace {

std::unique_ptr<CornerSet> detect(const DetectConfig& config, const test::Image& image, const SubImageSet& boxes,
                                  const RowMask* missing = nullptr) {
  auto out = std::make_unique<CornerSet>();
  std::make_unique<CornerDetector>(config, image.width, image.height)->detect(image.view(), missing, boxes, *out);
  return out;
}
SubImageSet whole(const test::Image& image) { return {{0, 0, image.width, image.height, 1}}; }

const Corner* nearest(const CornerSet& corners, double u, double v, double within) {
  const Corner* best = nullptr;
  for (const Corner& c : corners.items) {
    const double d = (c.uv_px - Vec2(u, v)).norm();
    if (d < within) best = &c, within = d;
  }
  return best;
}

bool same(const CornerSet& a, const CornerSet& b) {
  return std::equal(a.items.begin(), a.items.end(), b.items.begin(), b.items.end(), [](const Corner& x, const Corner& y) {
    return x.uv_px == y.uv_px && x.cov_px2 == y.cov_px2 && x.measure == y.measure && x.subpixel == y.subpixel;
  });
}

TEST(CornerDetector, ThesisModeAnswersTheSpecsStepCornerWithPixel10And10) {
  const auto image = test::step_corner_21();
  DetectConfig config = DetectConfig::thesis();
  for (MeanOver mean : {MeanOver::kInterior, MeanOver::kBox, MeanOver::kClearedBox}) {
    config.mean_over = mean;
    const auto corners = detect(config, image, whole(image));
    ASSERT_EQ(corners->items.size(), 1U);
    EXPECT_EQ(corners->items[0].uv_px, Vec2(10, 10));
    EXPECT_NEAR(corners->items[0].measure, 1959.558055, 5e-4);
    EXPECT_FALSE(corners->items[0].subpixel);
  }
}

TEST(CornerDetector, TheThresholdIsTheMeanTheSpecStates) {
  // GIVEN the step corner, Rc = 1959.558 WHEN the factor puts the threshold just below and just above it
  const auto image = test::step_corner_21();
  DetectConfig config = DetectConfig::thesis();
  const auto found = [&](MeanOver over, double threshold, double mean) {
    config.mean_over = over;
    config.threshold_factor = threshold / mean;
    return detect(config, image, whole(image))->items.size();
  };
  const std::pair<MeanOver, double> stated[] = {
      {MeanOver::kInterior, 125.338091}, {MeanOver::kClearedBox, 34.389816}, {MeanOver::kBox, 88.704774}};
  for (const auto& [over, mean] : stated) {
    EXPECT_EQ(found(over, 1959.55, mean), 1U);
    EXPECT_EQ(found(over, 1959.57, mean), 0U);
  }
}

TEST(CornerDetector, RefinedModeFindsTheIdealCornerOfTheStepBetweenThePixels) {
  // The ideal corner is at 9.5, 9.5; pixel quantisation alone put it at 10, 10.
  const auto image = test::step_corner_21();
  const auto corners = detect({}, image, whole(image));
  ASSERT_EQ(corners->items.size(), 1U);
  EXPECT_TRUE(corners->items[0].subpixel);
  EXPECT_LT((corners->items[0].uv_px - Vec2(9.5, 9.5)).norm(), 0.2);
}

TEST(CornerDetector, RefinedModeMeetsNoiseWithAnHonestCovariance) {
  test::Random random(21);
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  double square = 0, nees = 0;
  int found = 0, wedges_drawn = 0;
  for (int trial = 0; trial < 12; ++trial) {
    std::vector<test::Wedge> wedges;
    for (int i = 0; i < 16; ++i)
      wedges.push_back({40.0 + 60 * (i % 4) + unit(random), 40.0 + 60 * (i / 4) + unit(random), 6 * unit(random),
                        (90 + 60 * unit(random)) / 2 * std::numbers::pi / 180});
    const auto image = test::sky_with_wedges(260, wedges, 20, random);
    const auto corners = detect({}, image, whole(image));
    for (const auto& w : wedges) {
      ++wedges_drawn;
      const Corner* c = nearest(*corners, w.u, w.v, 2);
      if (c == nullptr || !c->subpixel) continue;
      ++found;
      const Vec2 e = c->uv_px - Vec2(w.u, w.v);
      square += e.squaredNorm();
      nees += e.dot(c->cov_px2.inverse() * e);
    }
  }
  std::printf("    contrast/noise 60: %d of %d found, rms %.3f px per axis, NEES %.2f\n", found, wedges_drawn,
              std::sqrt(square / found / 2), nees / found);
  EXPECT_GT(found, 0.98 * wedges_drawn);
  EXPECT_LT(std::sqrt(square / found / 2), 0.15);
  EXPECT_GT(nees / found, 0.4);
  EXPECT_LT(nees / found, 2.5);
}

TEST(CornerDetector, EightAndSixteenBitsAgree) {
  test::Random random(22);
  const std::vector<test::Wedge> wedges{{40.3, 50.2, 0.4, 0.8}, {80.7, 70.1, 2.5, 0.6}};
  const auto narrow = test::sky_with_wedges(120, wedges, 20, random, PixelFormat::kMono8);
  test::Image wide(120, 120, PixelFormat::kMono16);
  wide.fill([&](int u, int v) { return narrow.get(u, v) * 256; });
  DetectConfig config;
  config.noise = NoiseSource::kModel;  // the rounding of 1/12 count does not scale
  config.read_noise_counts = 4;
  const auto a = detect(config, narrow, whole(narrow));
  config.read_noise_counts = 4 * 256;
  const auto b = detect(config, wide, whole(wide));
  ASSERT_EQ(a->items.size(), b->items.size());
  ASSERT_GE(a->items.size(), 2U);
  for (std::size_t i = 0; i < a->items.size(); ++i) EXPECT_EQ(a->items[i].uv_px, b->items[i].uv_px);
}

TEST(CornerDetector, FeaturelessSkyGivesNoCornerThanksToTheNoiseFloor) {
  // GIVEN noise alone WHEN the mean is the only threshold THEN corners are found everywhere; with the floor next to none
  test::Random random(23);
  const auto image = test::sky_with_wedges(512, {}, 12, random);
  DetectConfig config;
  const auto floored = detect(config, image, whole(image));
  config.floor_noise = 0;
  const auto plain = detect(config, image, whole(image));
  std::printf("    512x512 of noise: %zu corners with the floor, %zu without\n", floored->items.size(), plain->items.size());
  EXPECT_LE(floored->items.size(), 3U);
  EXPECT_EQ(plain->items.size(), 1024U);  // as many as one box may have: of 512^2 / 49 maxima at most, the strongest
}

TEST(CornerDetector, CornersBesideMissingRowsAreNotReported) {
  test::Random random(24);
  const auto image = test::sky_with_wedges(160, {{40.2, 40.3, 0.5, 0.8}, {100.4, 110.1, 2, 0.8}}, 5, random);
  RowMask missing;
  missing.set_missing(44);
  missing.set_missing(45);
  const auto all = detect({}, image, whole(image)), masked = detect({}, image, whole(image), &missing);
  EXPECT_NE(nearest(*all, 40.2, 40.3, 2), nullptr);
  EXPECT_EQ(nearest(*masked, 40.2, 40.3, 6), nullptr);
  EXPECT_NE(nearest(*masked, 100.4, 110.1, 2), nullptr);
  EXPECT_EQ(masked->unreadable_px, 2U * 160U);
  EXPECT_EQ(all->unreadable_px, 0U);
  for (const Corner& c : masked->items) EXPECT_GT(std::abs(c.uv_px.y() - 44.5), 4);
}

TEST(CornerDetector, WhatMissingRowsHoldDoesNotMatter) {
  test::Random random(25);
  auto image = test::sky_with_wedges(160, {{40.2, 40.3, 0.5, 0.8}, {100.4, 110.1, 2, 0.8}}, 5, random);
  RowMask missing;
  for (int v : {3, 60, 61, 62, 159}) missing.set_missing(v);
  const auto before = detect({}, image, whole(image), &missing);
  for (int v : {3, 60, 61, 62, 159})
    for (int u = 0; u < 160; ++u) image.set(u, v, static_cast<int>(random() % 4096));
  EXPECT_TRUE(same(*before, *detect({}, image, whole(image), &missing)));
}

TEST(CornerDetector, CornersBesideSaturatedPixelsAreNotReported) {
  test::Random random(26);
  auto image = test::sky_with_wedges(160, {{40.2, 40.3, 0.5, 0.8}, {100.4, 110.1, 2, 0.8}}, 5, random);
  image.set(42, 38, 4095);
  const auto corners = detect({}, image, whole(image));
  EXPECT_EQ(nearest(*corners, 40.2, 40.3, 4), nullptr);
  EXPECT_NE(nearest(*corners, 100.4, 110.1, 2), nullptr);
  EXPECT_EQ(corners->unreadable_px, 1U);
  DetectConfig off;
  off.saturation_counts = 0;
  EXPECT_NE(nearest(*detect(off, image, whole(image)), 40.2, 40.3, 4), nullptr);
}

TEST(CornerDetector, CornersAgainstASaturatedSkyAreReportedAsLessCertain) {
  // GIVEN dark wedges before a sky that is one count below saturation, and the same with the sky saturated
  test::Random random(33);
  auto image = test::sky_with_wedges(160, {{60.2, 70.3, 0.5, 0.8}}, 0, random);
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u) image.set(u, v, image.get(u, v) > 1200 ? 4094 : image.get(u, v));
  const auto below = detect({}, image, whole(image));
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u) image.set(u, v, image.get(u, v) == 4094 ? 4095 : image.get(u, v));
  const auto clipped = detect({}, image, whole(image));
  const Corner *a = nearest(*below, 60.2, 70.3, 2), *b = nearest(*clipped, 60.2, 70.3, 2);
  ASSERT_NE(a, nullptr);
  ASSERT_NE(b, nullptr);
  EXPECT_LT((a->uv_px - b->uv_px).norm(), 0.05);
  EXPECT_NEAR(b->cov_px2(0, 0) - a->cov_px2(0, 0), 0.25, 0.01);
  DetectConfig strict;
  strict.saturation_sigma_px = -1;
  EXPECT_EQ(nearest(*detect(strict, image, whole(image)), 60.2, 70.3, 4), nullptr);
}

TEST(CornerDetector, TinyBoxesAndBoxesOutsideTheImageGiveNothing) {
  test::Random random(27);
  const auto image = test::random_image(64, 64, PixelFormat::kMono12, random);
  SubImageSet boxes{{0, 0, 1, 1, 1}, {5, 5, 10, 10, 1}, {63, 63, 1, 1, 1}, {60, 0, 4, 64, 1}, {-50, -50, 20, 20, 1}, {70, 70, 30, 30, 1}};
  for (const DetectConfig& config : {DetectConfig{}, DetectConfig::thesis()}) EXPECT_TRUE(detect(config, image, boxes)->items.empty());
}

TEST(CornerDetector, EveryBoxSizeKeepsItsBorder) {
  test::Random random(28);
  const auto image = test::random_image(70, 70, PixelFormat::kMono8, random);
  for (const DetectConfig& mode : {DetectConfig{}, DetectConfig::thesis()})
    for (int size = 1; size <= 40; ++size) {
      DetectConfig config = mode;
      config.subpixel_window_px = config.saturation_counts = 0;
      config.floor_noise = 0;
      const auto corners = detect(config, image, {{3, 7, size, size + 9, 1}});
      for (const Corner& c : corners->items) {
        EXPECT_GE(c.uv_px.x(), 3 + 5);
        EXPECT_LE(c.uv_px.x(), 3 + size - 6);
        EXPECT_GE(c.uv_px.y(), 7 + 5);
        EXPECT_LE(c.uv_px.y(), 7 + size + 9 - 6);
      }
      EXPECT_TRUE(size <= 30 || !corners->items.empty());
    }
}

TEST(CornerDetector, ABoxSeesTheSameCornersAsTheWholeImageAroundIt) {
  // GIVEN real pixels around the box and no mean threshold THEN cutting the image into boxes changes nothing inside
  test::Random random(29);
  const auto image = test::sky_with_wedges(200, {{60.2, 70.3, 0.5, 0.8}, {100.4, 90.1, 2, 0.8}}, 8, random);
  DetectConfig config;
  config.threshold_factor = 0;
  config.floor_noise = 0;
  config.floor_counts2 = 2000;
  config.noise = NoiseSource::kModel;
  const auto box = detect(config, image, {{30, 40, 101, 87, 1}}), all = detect(config, image, whole(image));
  std::size_t inside = 0;
  for (const Corner& c : box->items) {
    const Corner* same_one = nearest(*all, c.uv_px.x(), c.uv_px.y(), 1e-9);
    ASSERT_NE(same_one, nullptr);
    EXPECT_EQ(same_one->measure, c.measure);
    ++inside;
  }
  EXPECT_GE(inside, 2U);
}

TEST(CornerDetector, KeepsTheStrongestAndCountsTheRest) {
  test::Random random(30);
  const auto image = test::random_image(200, 200, PixelFormat::kMono8, random);
  DetectConfig config;
  config.saturation_counts = 0;
  config.floor_noise = 0;
  const auto all = detect(config, image, whole(image));
  config.max_corners = 40;
  const auto few = detect(config, image, whole(image));
  config.max_corners = static_cast<int>(kMaxCorners);
  config.max_corners_per_box = 40;
  const auto few_per_box = detect(config, image, whole(image));
  ASSERT_GT(all->items.size(), 500U);
  ASSERT_EQ(few->items.size(), 40U);
  EXPECT_EQ(few->overflow + 40, all->items.size());
  EXPECT_TRUE(same(*few, *few_per_box));
  std::vector<float> strengths;
  for (const Corner& c : all->items) strengths.push_back(c.measure);
  std::sort(strengths.rbegin(), strengths.rend());
  for (const Corner& c : few->items) EXPECT_GE(c.measure, strengths[39]);
}

TEST(CornerDetector, Takes4096WideImagesFullOfCorners) {
  test::Random random(31);
  const auto image = test::random_image(4096, 300, PixelFormat::kMono12, random);
  DetectConfig config;
  config.max_corners_per_box = static_cast<int>(kMaxCorners);
  config.saturation_counts = 0;
  config.floor_noise = 0;
  config.threshold_factor = 0.5;
  config.subpixel_window_px = 0;
  const auto corners = detect(config, image, whole(image));
  EXPECT_EQ(corners->items.size(), kMaxCorners);
  EXPECT_GT(corners->overflow, 1000U);
}

TEST(CornerDetector, IsDeterministicAndUsesNoHeap) {
  test::Random random(32);
  const auto image = test::sky_with_wedges(200, {{60.2, 70.3, 0.5, 0.8}, {100.4, 90.1, 2, 0.8}}, 8, random);
  const SubImageSet boxes{{30, 40, 61, 61, 1}, {95, 60, 81, 61, 2}};
  for (DetectConfig config : {DetectConfig{}, DetectConfig::thesis()}) {
    config.equalise = Equalise::kBox;
    auto detector = std::make_unique<CornerDetector>(config, 200, 200);
    auto first = std::make_unique<CornerSet>(), second = std::make_unique<CornerSet>();
    RowMask missing;
    missing.set_missing(120);
    test::HeapGuard guard;
    detector->detect(image.view(), &missing, boxes, *first);
    detector->detect(image.view(), &missing, boxes, *second);
    EXPECT_EQ(guard.count(), 0U);
    EXPECT_TRUE(same(*first, *second));
    EXPECT_FALSE(first->items.empty());
  }
}

TEST(CornerDetector, EqualisationRaisesTheMeasureOfALowContrastCorner) {
  // GIVEN twilight: 30 counts of contrast out of 4096
  const test::WedgePainter painter(0.5);
  test::Image image(61, 61, PixelFormat::kMono12);
  image.fill([&](int u, int v) { return static_cast<int>(50 + 30 * painter.share({30.2, 29.9, 0.3, 0.8}, u, v)); });
  DetectConfig config;
  const auto plain = detect(config, image, whole(image));
  config.equalise = Equalise::kBox;
  const auto raised = detect(config, image, whole(image));
  const Corner *a = nearest(*plain, 30.2, 29.9, 2), *b = nearest(*raised, 30.2, 29.9, 2);
  ASSERT_TRUE(a != nullptr && b != nullptr);
  EXPECT_GT(b->measure, 1000 * a->measure);
  EXPECT_LT((a->uv_px - b->uv_px).norm(), 0.02);  // refinement uses the pixels as they came
}

}  // namespace
}  // namespace cyclops
