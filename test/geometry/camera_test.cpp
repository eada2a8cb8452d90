#include "geometry/camera.hpp"

#include <gtest/gtest.h>

#include "test/support.hpp"

namespace cyclops {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

// Spec 1.6: 75 ft, elevation -15 deg, tilt 16 deg, 12.5 mm, lens at the receiver's origin.
TEST(Camera, ReproducesWorkedExampleOne) {
  const Point<frame::R> p_r(22.081064, 0, -5.916603);
  const auto R_c_r = camera_from_receiver({0, 16 * kDeg, 0});
  const Camera camera({}, {});
  const auto p_c = R_c_r * p_r;
  EXPECT_NEAR(p_c.xyz.x(), 0, 1e-6);
  EXPECT_NEAR(p_c.xyz.y(), 0.398962, 1e-6);
  EXPECT_NEAR(p_c.xyz.z(), 22.856518, 1e-6);
  const auto uv = camera.project(p_c);
  ASSERT_TRUE(uv);
  EXPECT_NEAR(uv->x(), 511.5, 1e-6);
  EXPECT_NEAR(uv->y(), 529.682359, 1e-4);
  EXPECT_NEAR(camera.z_point_m(*uv).y(), -2.181883e-4, 1e-9);
}

// Spec 1.7, last block: pan 3, tilt 16, roll -2 deg.
TEST(Camera, MountMatrixIsTheOneOfTheSpecification) {
  Mat3 want;
  want << -0.061910496, 0.997517745, -0.033547549, 0.273265425, 0.049268625, 0.960676121, 0.959944320, 0.050308550, -0.275637356;
  EXPECT_LT((camera_from_receiver({3 * kDeg, 16 * kDeg, -2 * kDeg}).matrix() - want).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Camera, JacobianAgreesWithNumericalOneBehindLensAndWindscreen) {
  Intrinsics k;
  k.k1 = -0.21; k.k2 = 0.05; k.p1 = 1e-3; k.p2 = -5e-4; k.k3 = 0.002; k.fy_px = 1030;
  std::vector<float> du, dv;
  for (int i = 0; i < 65; ++i)
    for (int j = 0; j < 65; ++j) {
      du.push_back(static_cast<float>(0.002 * j * i * 0.1));
      dv.push_back(static_cast<float>(-0.003 * i + 0.001 * j));
    }
  const Camera camera(k, Windscreen::from_grids(65, 65, 16, du, dv).value());
  test::Random random(7);
  std::uniform_real_distribution<double> side(-4, 4);
  for (int n = 0; n < 200; ++n) {
    const Point<frame::C> p(side(random), side(random), 12 + side(random));
    Eigen::Matrix<double, 2, 3> J;
    const auto uv = camera.project(p, J);
    ASSERT_TRUE(uv);
    for (int a = 0; a < 3; ++a) {
      Vec3 h = Vec3::Zero();
      h[a] = 1e-4;
      const Vec2 numeric = (*camera.project(Point<frame::C>(p.xyz + h)) - *camera.project(Point<frame::C>(p.xyz - h))) / 2e-4;
      EXPECT_LT((numeric - J.col(a)).norm(), 2e-3 * (1 + numeric.norm()));
    }
    EXPECT_LT((camera.raw_from_ideal(camera.ideal_from_raw(*uv)) - *uv).norm(), 1e-5);
  }
}

// Spec 2.2, smooth field sampled at every pixel.
TEST(Windscreen, UndoesItselfThroughTheIteratesOfTheSpecification) {
  std::vector<float> du, dv;
  for (int i = 0; i < 1024; ++i)
    for (int j = 0; j < 1024; ++j) {
      const double u = (j - 511.5) / 511.5, v = (i - 511.5) / 511.5;
      dv.push_back(static_cast<float>(2 + 4 * v * v * u));
      du.push_back(static_cast<float>(-1 + 3 * u * u * u));
    }
  const auto w = Windscreen::from_grids(1024, 1024, 1, du, dv).value();
  const Vec2 raw = w.distort({637.380287, 430.032951});
  EXPECT_NEAR(raw.x(), 636.425002, 2e-4);
  EXPECT_NEAR(raw.y(), 432.057923, 2e-4);
  const Vec2 back = w.undistort(raw);
  EXPECT_NEAR(back.x(), 637.380287, 2e-5);
  EXPECT_NEAR(back.y(), 430.032951, 2e-5);
}

TEST(Windscreen, RefusesAFileThatEndsEarly) {
  test::TempDir dir;
  const auto w = Windscreen::from_grids(2, 2, 512, {0, 1, 2, 3}, {0, 1, 2, 3}).value();
  ASSERT_TRUE(w.save(dir.file("w.bin")).ok());
  EXPECT_TRUE(Windscreen::load(dir.file("w.bin")).ok());
  std::filesystem::resize_file(dir.file("w.bin"), 40);
  const auto cut = Windscreen::load(dir.file("w.bin"));
  ASSERT_FALSE(cut.ok());
  EXPECT_EQ(cut.error().code, ErrorCode::kTruncated);
}

}  // namespace
}  // namespace cyclops
