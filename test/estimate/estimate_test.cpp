#include "estimate/estimate.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "test/scene.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

using test::kDeg;

struct Place {
  FeatureId id;
  double u, v;
};

std::unique_ptr<PredictionSet> predicted(const RelativeState& state, const TankerModel& model, const Camera& camera,
                                         const CameraMount& mount, const EstimateConfig& config = {}) {
  auto out = std::make_unique<PredictionSet>();
  predict(state, model, camera, mount, config, *out);
  return out;
}

void expect_places(const PredictionSet& set, std::initializer_list<Place> places, double tolerance) {
  ASSERT_EQ(set.items.size(), places.size());
  std::size_t i = 0;
  for (const Place& want : places) {
    const Prediction& p = set.items[i];
    EXPECT_EQ(p.id, want.id);
    EXPECT_EQ(p.feature, i++);
    EXPECT_EQ(p.visibility, Visibility::kVisible) << p.id;
    EXPECT_NEAR(p.uv_px.x(), want.u, tolerance) << p.id;
    EXPECT_NEAR(p.uv_px.y(), want.v, tolerance) << p.id;
  }
}

// Spec 1.7: relative attitude (2, -1, 3) deg, all six features through model, body, mount and camera, then to Z points.
TEST(Estimate, ReproducesTheSixFeaturesOfWorkedExampleTwo) {
  const Camera camera({}, {});
  const auto set = predicted(test::example_state(), test::example_model(), camera, test::example_mount());
  EXPECT_TRUE(set->from_nav);
  expect_places(*set, {{2, 511.500000, 529.682359}, {1, 637.380287, 430.032951}, {3, 400.483799, 421.389955},
                       {15, 816.722181, 613.749984}, {22, 228.753087, 587.477063}, {29, 607.563503, 634.653982}}, 1e-6);
  const double z[6][2] = {{0, -2.181883e-4}, {-1.510563e-3, 9.776046e-4}, {1.332194e-3, 1.081321e-3},
                          {-3.662666e-3, -1.227000e-3}, {3.392963e-3, -9.117248e-4}, {-1.152762e-3, -1.477848e-3}};
  for (std::size_t i = 0; i < 6; ++i) {
    const Vec2 got = camera.z_point_m(camera.ideal_from_raw(set->items[i].uv_px));
    EXPECT_NEAR(got.x(), z[i][0], 1e-9);
    EXPECT_NEAR(got.y(), z[i][1], 1e-9);
  }
  const Vec3 sight = camera.line_of_sight(set->items[3].uv_px);
  EXPECT_LT((sight - Vec3(0.279951, 0.093784, 0.955422)).norm(), 1e-6);
}

// Expected values from an independent calculation in another language; unequal angles above 10 deg, all mount angles in use.
TEST(Estimate, AgreesWithAnIndependentCalculationInASteepRightBank) {
  const auto state = test::relative_state({12, -7, 25}, {33, 1.5, -6});
  const auto set = predicted(state, test::example_model(), Camera({}, {}), test::mount_deg(3, 16, -2, {2.4, -0.15, -0.6}));
  expect_places(*set, {{2, 471.071452, 466.975523}, {1, 635.196364, 424.431470}, {3, 428.664405, 343.702565},
                       {15, 785.995158, 698.784043}, {22, 268.693628, 462.837860}, {29, 585.048801, 643.696663}}, 1e-6);
}

TEST(Estimate, AgreesWithAnIndependentCalculationInALeftTurnWithNoseUp) {
  const auto state = test::relative_state({-20, 14, -11}, {30, -2.5, -7});
  const auto set = predicted(state, test::example_model(), Camera({}, {}), test::mount_deg(-4, 18, 5, {2.4, 0.3, -0.6}));
  expect_places(*set, {{2, 589.282233, 560.467098}, {1, 679.353126, 406.416943}, {3, 417.548113, 453.464139},
                       {15, 794.450264, 517.924002}, {22, 171.305743, 654.675081}, {29, 585.269455, 580.557986}}, 1e-6);
}

// A tanker left of the receiver is in the left half, one above the optical axis in the upper half.
TEST(Estimate, PutsLeftLeftAndUpUp) {
  const auto model = test::example_model();
  const auto mount = test::mount_deg(0, 16, 0, {0, 0, 0});
  const auto centre_of = [&](const Vec3& t) -> Vec2 {
    return predicted(test::relative_state({0, 0, 0}, t), model, Camera({}, {}), mount)->items[0].uv_px;
  };
  EXPECT_LT(centre_of({40, -5, -11}).x(), 511.5);
  EXPECT_GT(centre_of({40, 5, -11}).x(), 511.5);
  EXPECT_LT(centre_of({40, 0, -15}).y(), centre_of({40, 0, -11}).y());
}

// Spec 2.2: undistorted (row 430.032951, col 637.380287) appears at (432.057923, 636.425002).
TEST(Estimate, MovesAFeatureByTheWindscreen) {
  const Camera camera({}, test::example_windscreen());
  const auto set = predicted(test::example_state(), test::example_model(), camera, test::example_mount());
  EXPECT_NEAR(set->items[1].uv_px.x(), 636.425002, 2e-4);
  EXPECT_NEAR(set->items[1].uv_px.y(), 432.057923, 2e-4);
  const Vec2 back = camera.ideal_from_raw(set->items[1].uv_px);
  EXPECT_NEAR(back.x(), 637.380287, 2e-5);
  EXPECT_NEAR(back.y(), 430.032951, 2e-5);
}

TEST(Estimate, TellsBehindOutsideDisabledAndVisibleApart) {
  const std::string csv = "id,x,y,z,enabled\n1,0,0,0,1\n2,400,0,0,1\n3,0,2000,0,1\n4,0,0,0,0\n5,400,0,0,0\n";
  const auto model = TankerModel::parse(csv, "test", 0.0254, {0, 0, 0}).value();
  const auto set = predicted(test::relative_state({0, 0, 0}, {10, 0, 0}), model, Camera({}, {}), test::mount_deg(0, 0, 0, {1, 0, 0}));
  const Visibility want[5] = {Visibility::kVisible, Visibility::kBehindCamera, Visibility::kOutsideImage, Visibility::kDisabled,
                              Visibility::kBehindCamera};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(set->items[i].visibility, want[i]) << i;
  EXPECT_NEAR(set->items[0].range_m, 9, 1e-12);
  EXPECT_NEAR(set->items[3].uv_px.x(), 511.5, 1e-9);
}

// Model axes: x aft, y right, z up. The camera is behind the tanker and looks along its nose.
TEST(Estimate, HidesAPaintedCornerThatFacesAwayAndKeepsAnEdgeWithOneFaceTowardsTheCamera) {
  const std::string csv =
      "id,x,y,z,normals\n1,0,0,0,-1 0 0\n2,0,0,0,1 0 0\n3,0,0,0,-1 0 0; 0.6 0.8 0\n4,0,0,0,\n";
  const auto model = TankerModel::parse(csv, "test", 0.0254, {0, 0, 0}).value();
  const auto state = test::relative_state({0, 0, 0}, {10, 0, 0});
  const auto mount = test::mount_deg(0, 0, 0, {0, 0, 0});
  const auto set = predicted(state, model, Camera({}, {}), mount);
  EXPECT_EQ(set->items[0].visibility, Visibility::kFacingAway);
  EXPECT_EQ(set->items[1].visibility, Visibility::kVisible);
  EXPECT_EQ(set->items[2].visibility, Visibility::kVisible);
  EXPECT_EQ(set->items[3].visibility, Visibility::kVisible);
  const auto turned = predicted(test::relative_state({180, 0, 0}, {10, 0, 0}), model, Camera({}, {}), mount);
  EXPECT_EQ(turned->items[0].visibility, Visibility::kVisible);
  EXPECT_EQ(turned->items[1].visibility, Visibility::kFacingAway);
  EstimateConfig thesis;
  thesis.use_normals = false;
  const auto all = predicted(state, model, Camera({}, {}), mount, thesis);
  for (const Prediction& p : all->items) EXPECT_EQ(p.visibility, Visibility::kVisible);
}

TEST(Estimate, HidesALearntFeatureOutsideTheSectorItWasSeenFrom) {
  const auto model = TankerModel::parse("id,x,y,z,seen_from,seen_range\n1,0,0,0,1 0 0 20,5 15\n2,0,0,0,1 0 0.5 20,5 15\n3,0,0,0,1 0 0 20,12 15\n", "test", 1, {0, 0, 0}).value();
  const auto set = predicted(test::relative_state({0, 0, 0}, {10, 0, 0}), model, Camera({}, {}), test::mount_deg(0, 0, 0, {0, 0, 0}));
  EXPECT_EQ(set->items[0].visibility, Visibility::kVisible);
  EXPECT_EQ(set->items[1].visibility, Visibility::kFacingAway) << "27 degrees off its axis";
  EXPECT_EQ(set->items[2].visibility, Visibility::kFacingAway) << "nearer than ever";
}

TEST(Estimate, GivesNothingForAnInvalidState) {
  auto state = test::example_state();
  state.valid = false;
  const auto set = predicted(state, test::example_model(), Camera({}, {}), test::example_mount());
  EXPECT_TRUE(set->items.empty());
  EXPECT_FALSE(set->from_nav);
}

TEST(Estimate, ConfigurationNamesAValueOutOfRange) {
  auto file = ConfigFile::parse("[estimate]\nuse_normals = false\nfocal_sigma = 0.5\n", "profile").value();
  auto table = file.root().table("estimate");
  ASSERT_TRUE(EstimateConfig::read(table, {}).ok());
  const auto done = file.finish();
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().message().find("focal_sigma"), std::string::npos);
}

TEST(Estimate, TheWayOfAFeatureIsTheDifferenceOfItsTwoPlaces) {
  const Camera camera({}, test::example_windscreen());
  const TankerModel model = test::example_model();
  const RelativeState before = test::relative_state({2, -1, 3}, {33, 0.1, -5.4}), now = test::relative_state({2.4, -1.3, 2.1}, {32.8, 0.2, -5.5});
  const auto from = predicted(before, model, camera, test::example_mount()), to = predicted(now, model, camera, test::example_mount());
  RigidMotion way;
  displace(before, now, model, camera, test::example_mount(), way);
  ASSERT_EQ(way.items.size(), model.features().size());
  for (std::size_t i = 0; i < way.items.size(); ++i) {
    EXPECT_TRUE(way.items[i].known);
    EXPECT_LT((way.items[i].px - (to->items[i].uv_px - from->items[i].uv_px)).norm(), 1e-9) << i;
    EXPECT_GT(way.items[i].px.norm(), 1) << i;
  }
  displace(before, test::relative_state({0, 0, 0}, {-33, 0, 0}), model, camera, test::example_mount(), way);
  for (const Displacement& d : way.items) EXPECT_FALSE(d.known) << "behind the camera";
}

}  // namespace
}  // namespace cyclops
