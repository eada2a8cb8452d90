// The windscreen nobody built, and what a calibration makes of it.
#include "hil/made_up_windscreen.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "hil/render.hpp"

namespace cyclops::hil {
namespace {

TEST(MadeUpWindscreen, ItsCalibrationIsNearlyRightAndNotRight) {
  const auto w = made_up_windscreen(1024, 1024, 1).value();
  const auto measured = calibrated_windscreen(w, 1024, 1024, {.sigma_px = 0.5}).value();
  double mean = 0, most = 0;
  for (int i = 0; i < 32; ++i)
    for (int j = 0; j < 32; ++j) {
      const double error = (w.delta({32.0 * j, 32.0 * i}) - measured.delta({32.0 * j, 32.0 * i})).norm();
      mean += error / 1024, most = std::max(most, error);
    }
  EXPECT_GT(mean, 0.2);
  EXPECT_LT(mean, 1);
  EXPECT_LT(most, 3);
}

TEST(MadeUpWindscreen, ItsCalibrationHoldsAtTheWallAndIsOffByTheParallaxElsewhere) {
  // GIVEN a windscreen with parallax and the delta matrices of a perfect measurement in front of a wall 20 m away
  constexpr double kParallax_mm = 6;
  const Camera exact({}, made_up_windscreen(1024, 1024, 1).value());
  const double f = exact.intrinsics().fx_px;
  const Camera told({}, calibrated_windscreen(exact.windscreen(), 1024, 1024, {.sigma_px = 0, .step_px = 16, .parallax_mm = kParallax_mm, .range_m = 20, .focal_px = f}).value());
  Look look;
  look.sky.uniform_cdm2 = 0;
  look.optics.windscreen_parallax_mm = kParallax_mm;
  const Renderer truth(exact, Mesh{}, look, 1);
  for (const double range_m : {10.0, 20.0, 100.0}) {
    double off = 0;
    for (int i = 1; i < 16; ++i)
      for (int j = 1; j < 16; ++j) {
        const Point<frame::C> p(Vec3((64.0 * j - 511.5) / f, (64.0 * i - 511.5) / f, 1) * range_m);
        const Vec2 uv = *truth.project(p), error = uv - *told.project(p);
        // THEN what they are off by is the parallax of this range less that of the wall
        const Vec2 expected = f * (1 / 20.0 - 1 / range_m) * windscreen_parallax_m(uv, 1024, 1024, kParallax_mm);
        EXPECT_LT((error - expected).norm(), 0.02) << range_m << " m, " << uv.transpose();
        off = std::max(off, error.norm());
      }
    if (range_m == 20) EXPECT_LT(off, 0.02);
    else EXPECT_GT(off, 0.2);
  }
}

TEST(MadeUpWindscreen, ShiftsByAboutAPixelAndCanBeUndone) {
  const auto w = made_up_windscreen(1024, 1024, 1).value();
  double mean = 0, most = 0, back = 0;
  for (int i = 0; i < 32; ++i)
    for (int j = 0; j < 32; ++j) {
      const Vec2 at(32 * j + 16, 32 * i + 16);
      mean += w.delta(at).norm() / 1024;
      most = std::max(most, w.delta(at).norm());
      back = std::max(back, (w.undistort(w.distort(at)) - at).norm());
    }
  EXPECT_NEAR(mean, 1.2, 0.2);
  EXPECT_LT(most, 5);
  EXPECT_LT(back, 1e-5);
}

}  // namespace
}  // namespace cyclops::hil
