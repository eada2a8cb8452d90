// Looks from pictures: the plate is painted, its pose is known with an error, what the looks say of it is judged by the true one.
#include "tools/learn_looks.hpp"

#include <gtest/gtest.h>

#include <random>

#include "test/patch/look_scene.hpp"

namespace cyclops {
namespace {

namespace learn = tools::learn;
using test::dark;
using test::grain;
using test::LookScene;

class LearnLooksTest : public ::testing::Test {
 protected:
  /// Views of frames 0 to n - 1, each with a pose that is off by `off_m` 1 sigma across.
  void fly(int n, double off_m, const std::function<test::Paint(int)>& paint = [](int) { return grain; }) {
    test::Random random(11);
    std::normal_distribution<double> normal(0, off_m);
    views.flights = {"flights/one two"};
    views.cameras.push_back(std::make_unique<Camera>(scene.plate.camera));
    views.tanker = scene.plate.model;
    for (int k = 0; k < n; ++k) {
      const test::CameraPose t = LookScene::truth(k);
      const ImageView image = scene.plate.draw(t, paint(k), dark, static_cast<std::uint64_t>(k + 1));
      learn::View view{0, 0.1 * k, views.cameras[0].get(), {t.rotation(), Point<frame::C>(t.translation().xyz + Vec3(normal(random), normal(random), 0))}, 1e-6 * Mat6::Identity(), {}};
      view.picture = {20, 10, 280, 220, image.format, {}};
      for (int v = 0; v < 220; ++v) view.picture.pixels.insert(view.picture.pixels.end(), image.row8(v + 10) + 20, image.row8(v + 10) + 300);
      view.visible = {false, false, false, false, true, true};
      views.views.push_back(std::move(view));
    }
  }
  /// Of the look's feature, px, from its true place in the picture it was taken from.
  double anchor_error_px(const Look& look) const {
    double least = 1e9;
    for (std::size_t k = 0; k < views.views.size(); ++k) {
      if ((views.views[k].T_c_k.translation().xyz - look.patch.T_c_k.translation().xyz).norm() > 1e-12) continue;
      const Vec2 believed = *scene.plate.camera.project(views.views[k].T_c_k * look.p_k), middle(std::lround(believed.x()), std::lround(believed.y()));
      least = (middle + look.patch.inside_px - scene.plate.at(LookScene::truth(static_cast<int>(k)), look.feature)).norm();
    }
    return least;
  }
  LookScene scene;
  learn::Views views;
};

TEST_F(LearnLooksTest, EachLookKnowsWhereItsFeatureIsBetterThanThePoseOfItsView) {
  // GIVEN 30 views with poses off by half a pixel an axis
  fly(30, 0.015);
  const Looks looks = learn::learn_looks({}, {}, views, views.tanker);
  // THEN looks of both features that are seen, spread over the views, found in nearly all others, right to a fraction of that
  ASSERT_GE(looks.items.size(), 6U);
  double square = 0;
  for (const Look& l : looks.items) {
    EXPECT_TRUE(l.id == 5 || l.id == 6);
    EXPECT_EQ(l.light, "one_two");
    EXPECT_GE(l.matched, 0.9 * l.tried);
    EXPECT_GT(l.correlation, 0.9);
    EXPECT_NEAR(l.scatter_px, 0.5, 0.25) << "that of the poses";
    square += std::pow(anchor_error_px(l), 2) / static_cast<double>(looks.items.size());
  }
  EXPECT_LT(std::sqrt(square), 0.35);
  const auto read = Looks::parse(looks.text(), "looks", views.tanker);
  EXPECT_TRUE(read.ok()) << read.error().message();
}

TEST_F(LearnLooksTest, WhatSlidesOrIsNeverFoundAgainGetsNoLook) {
  // GIVEN surroundings that are painted anew in every frame
  fly(12, 1e-9, [](int k) { return [k](double y, double z) { return grain(y + 5.3 * k * k, z - 3.1 * k); }; });
  EXPECT_TRUE(learn::learn_looks({}, {}, views, views.tanker).items.empty());
}

TEST_F(LearnLooksTest, AFeatureThatIsSwitchedOffOrNotSeenGetsNone) {
  fly(12, 1e-9);
  const TankerModel off = TankerModel::parse("id,x,y,z,sigma,enabled\n1,0,-2,2,0,1\n2,0,2,2,0,1\n3,0,2,-2,0,1\n4,0,-2,-2,0,1\n5,0,0.3,0.5,0,0\n6,0,-0.7,-0.6,0,1\n", "plate", 1, Vec3::Zero()).value();
  const Looks looks = learn::learn_looks({}, {}, views, off);
  ASSERT_FALSE(looks.items.empty());
  for (const Look& l : looks.items) EXPECT_EQ(l.id, 6);
}

}  // namespace
}  // namespace cyclops
