#include "tools/true_pose.hpp"

#include <gtest/gtest.h>

#include "test/tools/learn_scene.hpp"

namespace cyclops::tools {
namespace {

using test::LearnScene;

TEST(TruePose, IsFoundFromThePixelsOfAFrame) {
  LearnScene scene(20);
  const align::CameraPose truth = LearnScene::pose_at(5, 40);
  std::vector<PointPixel> pixels;
  for (const auto& p : scene.points) pixels.push_back({p, *scene.views.cameras[0]->project(truth * p), Mat2::Identity()});
  align::Vec6 off;
  off << 0.05, -0.03, 0.04, 1, -0.5, 2;
  const auto fitted = fit_pose(*scene.views.cameras[0], pixels, align::moved(truth, off));
  ASSERT_TRUE(fitted);
  EXPECT_LT(align::difference(fitted->T_c_k, truth).norm(), 1e-8);
  EXPECT_FALSE(fit_pose(*scene.views.cameras[0], {pixels.begin(), pixels.begin() + 3}, truth)) << "three points are too few";
}

TEST(TruePose, TakesHiddenFeaturesOfAGeneratedFlightAndLeavesThoseOfAnImportedOne) {
  // GIVEN truth of the scene's survey in one frame, all of it hidden
  // WHEN it has a pose, its pixels were worked out: they count. WHEN it has none, hidden ones were not measured
  LearnScene scene(20);
  scene.fly(1);
  const align::CameraPose pose = LearnScene::pose_at(5, 40);
  const TankerModel& own = scene.views.tanker;
  truth_t truth{};
  for (const Feature& f : own.features()) {
    const auto at = scene.views.cameras[0]->project(pose * own.in_body(f));
    ASSERT_TRUE(at);
    truth.id.push_back(f.id);
    truth.u_px.push_back(at->x());
    truth.v_px.push_back(at->y());
    truth.visible.push_back(truth_t::HIDDEN);
  }
  ASSERT_GE(truth.id.size(), 6U);
  truth.has_pose = 1;
  align::Vec6 off;
  off << 0.02, -0.03, 0.01, 0.5, -0.5, 1;
  const auto fitted = true_pose(*scene.views.cameras[0], own, truth, align::moved(pose, off));
  ASSERT_TRUE(fitted);
  EXPECT_LT(align::difference(fitted->T_c_k, pose).norm(), 1e-7);
  truth.has_pose = 0;
  EXPECT_FALSE(true_pose(*scene.views.cameras[0], own, truth, pose));
}

}  // namespace
}  // namespace cyclops::tools
