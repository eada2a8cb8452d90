#include "patch/patch_matcher.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "test/patch/look_scene.hpp"

namespace cyclops {
namespace {

using test::blots;
using test::dark;

class PatchMatcherTest : public test::MatcherTest {
 protected:
  static test::CameraPose truth(int n) { return test::LookScene::truth(n); }
  void frame(PatchMatcher& matcher, int n, const test::CameraPose& agreed, const test::Paint& paint = blots) {
    show(matcher, plate, truth(n), agreed, paint, 0.3, static_cast<std::uint64_t>(n + 1));
  }

  test::Plate plate;
};

TEST_F(PatchMatcherTest, FindsWhatIsNoCornerAgain) {
  // GIVEN a pose that is right on average and wrong by some 0.7 px in each frame
  PatchMatcher matcher({}, plate.model, plate.camera);
  test::Random random(5);
  std::normal_distribution<double> n(0, 0.02);
  double sum = 0;
  int found = 0;
  for (int k = 0; k < 40; ++k) {
    const auto t = truth(k);
    frame(matcher, k, {t.rotation(), Point<frame::C>(t.translation().xyz + Vec3(n(random), n(random), 0))});
    if (k < 25) continue;
    for (int f = 4; f < 6; ++f)
      if (const Corner* c = of(f)) {
        const Vec2 error = c->uv_px - plate.at(t, static_cast<std::size_t>(f));
        sum += error.norm();
        EXPECT_LT(error.dot(c->cov_px2.inverse() * error), 11.0);
        EXPECT_EQ(c->kind, PointKind::kPatch);
        ++found;
      }
  }
  // THEN the two features inside are found nearly always, better than the pose of a frame is known
  EXPECT_GE(found, 26);
  EXPECT_LT(sum / found, 0.45);
}

TEST_F(PatchMatcherTest, WhatSlidesAgainstTheFeatureIsNotIt) {
  // GIVEN surroundings painted on something else, which moves by 0.5 px a frame against the plate
  PatchMatcher matcher({}, plate.model, plate.camera);
  int found = 0;
  for (int k = 0; k < 40; ++k) {
    frame(matcher, k, truth(k), [k](double y, double z) { return blots(y + 0.015 * k, z); });
    if (k >= 10 && of(4) != nullptr) ++found;
  }
  EXPECT_LE(found, 3);
}

TEST_F(PatchMatcherTest, HoldsThePoseByTheMeanOfManyFrames) {
  // GIVEN a pose that is right for 30 frames and then wrong by a pixel, all in one
  PatchMatcher matcher({}, plate.model, plate.camera);
  double right = 0, wrong = 0;
  int held = 0;
  for (int k = 0; k < 31; ++k) {
    const auto t = truth(k);
    const Vec3 off(k == 30 ? 0.04 : 0, 0, 0);
    const test::CameraPose agreed(t.rotation(), Point<frame::C>(t.translation().xyz + off));
    if (k == 30) {
      EXPECT_GT((plate.at(agreed, 4) - plate.at(t, 4)).norm(), 0.9);
    }
    frame(matcher, k, agreed);
    if (k < 8) {
      EXPECT_TRUE(matcher.landmarks().empty()) << k;
    }
    for (const Landmark& mark : matcher.landmarks()) {
      (k == 30 ? wrong : right) = std::max(k == 30 ? wrong : right, (mark.uv_px - plate.at(t, mark.feature)).norm());
      EXPECT_GE(mark.cov_px2(0, 0), 0.25);
      held += k == 30;
    }
  }
  // THEN what is found in the last frame lies where the features are, not where its pose has them
  EXPECT_GE(held, 2);
  EXPECT_LT(right, 0.5);
  EXPECT_LT(wrong, 0.5);
}

TEST_F(PatchMatcherTest, LearnsNothingFromAPoseThatItGaveItself) {
  // GIVEN patches anchored where their features are, then ten frames of a pose a pixel off that is by landmarks
  PatchMatcher matcher({}, plate.model, plate.camera);
  for (int k = 0; k < 30; ++k) frame(matcher, k, truth(k));
  alignment.by_landmarks = true;
  double sum = 0;
  int n = 0;
  for (int k = 30; k < 40; ++k) {
    const auto t = truth(k);
    frame(matcher, k, {t.rotation(), Point<frame::C>(t.translation().xyz + Vec3(0.04, 0, 0))});
    for (const Landmark& mark : matcher.landmarks()) sum += (mark.uv_px - plate.at(t, mark.feature)).norm();
    n += static_cast<int>(matcher.landmarks().size());
  }
  EXPECT_GE(n, 12);
  EXPECT_LT(sum / n, 0.5);
}

TEST_F(PatchMatcherTest, HoldsNothingWhereItIsToldNotTo) {
  PatchConfig config;
  config.hold_frames = 0;
  PatchMatcher matcher(config, plate.model, plate.camera);
  for (int k = 0; k < 30; ++k) {
    frame(matcher, k, truth(k));
    EXPECT_TRUE(matcher.landmarks().empty());
  }
}

TEST_F(PatchMatcherTest, NoConsensusNoImageNoContrastGiveNothing) {
  PatchMatcher matcher({}, plate.model, plate.camera);
  for (int k = 0; k < 6; ++k) frame(matcher, 0, truth(0), dark);
  EXPECT_TRUE(corners->items.empty());
  for (int k = 0; k < 12; ++k) frame(matcher, 0, truth(0));
  EXPECT_FALSE(corners->items.empty());
  corners->items.clear();
  auto mask = std::make_unique<RowMask>();
  for (int v = 0; v < 240; ++v) mask->set_missing(v);
  matcher.find(image, mask.get(), alignment, *aligned);
  EXPECT_TRUE(matcher.landmarks().empty());
  matcher.measure(image, mask.get(), alignment, *aligned, *corners);
  alignment.consensus = false;
  matcher.find(image, nullptr, alignment, *aligned);
  EXPECT_TRUE(matcher.landmarks().empty());
  matcher.measure(image, nullptr, alignment, *aligned, *corners);
  EXPECT_TRUE(corners->items.empty());
}

TEST_F(PatchMatcherTest, UsesNoHeapOnceMade) {
  PatchMatcher matcher({}, plate.model, plate.camera);
  frame(matcher, 0, truth(0));
  const test::HeapGuard guard;
  matcher.find(image, nullptr, alignment, *aligned);
  matcher.measure(image, nullptr, alignment, *aligned, *corners);
  EXPECT_EQ(guard.count(), 0U);
}

}  // namespace
}  // namespace cyclops
