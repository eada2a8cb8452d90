// Looks in flight, through PatchMatcher: a plate is painted, looks of it are known, the aligned pose is off.
#include "patch/look_matcher.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "patch/patch_matcher.hpp"
#include "test/patch/look_scene.hpp"

namespace cyclops {
namespace {

using test::grain;
using test::dark;
using test::LookScene;

double otherwise(double y, double z) { return 120 + 50 * std::cos(7.3 * y + 1.1) * std::sin(6.1 * z); }

class LookMatcherTest : public test::MatcherTest {
 protected:
  /// Frame n, with the pose off by `off_m` to the right.
  void frame(PatchMatcher& matcher, int n, double off_m = 0) {
    const test::CameraPose t = LookScene::truth(n);
    show(matcher, scene.plate, t, {t.rotation(), Point<frame::C>(t.translation().xyz + Vec3(off_m, 0, 0))}, grain, 0.4, static_cast<std::uint64_t>(n + 100));
  }
  Vec2 error(int feature, int n) const { return of(feature)->uv_px - scene.plate.at(LookScene::truth(n), static_cast<std::size_t>(feature)); }

  LookScene scene;
};

TEST_F(LookMatcherTest, AFeatureIsMeasuredInTheFirstFrameWhateverItsPoseIsOff) {
  // GIVEN a look from a view 2 degrees and 3 % of the range away, and a first frame whose pose puts everything 0.7 px to the right
  Looks looks;
  looks.items = {scene.look(4, 0), scene.look(5, 0)};
  PatchMatcher with({}, scene.plate.model, scene.plate.camera, looks), without({}, scene.plate.model, scene.plate.camera);
  frame(without, 8, 0.02);
  EXPECT_TRUE(corners->items.empty());
  // WHEN it is looked for
  frame(with, 8, 0.02);
  // THEN the features with looks are where they are, and not where the pose has them
  EXPECT_EQ(corners->items.size(), 2U);
  for (int f : {4, 5}) {
    ASSERT_NE(of(f), nullptr);
    EXPECT_LT(error(f, 8).norm(), 0.15);
    EXPECT_LT(error(f, 8).dot(of(f)->cov_px2.inverse() * error(f, 8)), 9.2);
    EXPECT_EQ(of(f)->kind, PointKind::kPatch);
  }
}

TEST_F(LookMatcherTest, ALookOfAnotherLensFits) {
  // GIVEN a look taken from twice as far through twice the focal length
  Intrinsics far = scene.plate.camera.intrinsics();
  far.fx_px = far.fy_px = 600;
  LookScene longer;
  longer.plate.camera = Camera(far, {});
  const test::CameraPose t = LookScene::truth(0), twice{t.rotation(), Point<frame::C>(t.translation().xyz.x() * 2, t.translation().xyz.y() * 2, t.translation().xyz.z() * 2)};
  Look l = scene.look(4, 0);
  ASSERT_TRUE(PatchSearch({}, longer.plate.camera).take(longer.plate.draw(twice, grain, dark, 1), nullptr, twice, l.p_k, longer.plate.at(twice, 4), l.patch));
  Looks looks;
  looks.items = {l};
  PatchMatcher matcher({}, scene.plate.model, scene.plate.camera, looks);
  frame(matcher, 2);
  ASSERT_NE(of(4), nullptr);
  EXPECT_LT(error(4, 2).norm(), 0.2);
}

TEST_F(LookMatcherTest, ALookFromElsewhereIsNotTried) {
  Looks looks;
  looks.items = {scene.look(4, 0)};
  PatchMatcher matcher({}, scene.plate.model, scene.plate.camera, looks);
  frame(matcher, 60);
  EXPECT_EQ(of(4), nullptr) << "14 degrees and a fifth of the range away";
}

TEST_F(LookMatcherTest, OfTwoLooksTheOneThatAgreesIsKept) {
  // GIVEN two looks of the same view, the one that claims to be better shows the feature 2.5 px aside
  Look wrong = scene.look(4, 0), right = scene.look(4, 0);
  wrong.patch.inside_px += Vec2(2.5, 0);
  wrong.scatter_px = 0.05;
  right.scatter_px = 0.3;
  Looks looks;
  looks.items = {wrong, right};
  PatchConfig config;
  LookMatcher matcher(config, scene.plate.camera, looks, scene.plate.model.features().size());
  PatchSearch search(config, scene.plate.camera);
  int good = 0;
  for (int k = 0; k < 12; ++k) {
    const test::CameraPose t = LookScene::truth(k);
    image = scene.plate.draw(t, grain, dark, static_cast<std::uint64_t>(k + 1));
    alignment.T_c_k = t;
    scene.plate.predict(t, 0.4, *aligned);
    Corner c;
    if (matcher.find(search, image, nullptr, alignment, aligned->items[4], c) && (c.uv_px - scene.plate.at(t, 4)).norm() < 0.3) ++good;
  }
  // THEN after a few frames the other one is used
  EXPECT_GE(good, 8);
}

TEST_F(LookMatcherTest, ALookOfSomethingElseIsNotFound) {
  Looks looks;
  looks.items = {scene.look(4, 0, otherwise)};
  PatchMatcher matcher({}, scene.plate.model, scene.plate.camera, looks);
  frame(matcher, 0);
  EXPECT_TRUE(corners->items.empty());
}

TEST_F(LookMatcherTest, UsesNoHeapOnceMade) {
  Looks looks;
  looks.items = {scene.look(4, 0), scene.look(5, 0)};
  PatchMatcher matcher({}, scene.plate.model, scene.plate.camera, looks);
  frame(matcher, 0);
  const test::HeapGuard guard;
  matcher.find(image, nullptr, alignment, *aligned);
  matcher.measure(image, nullptr, alignment, *aligned, *corners);
  EXPECT_EQ(guard.count(), 0U);
}

}  // namespace
}  // namespace cyclops
