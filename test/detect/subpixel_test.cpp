#include "detect/subpixel.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "test/detect/images.hpp"

namespace cyclops {
namespace {

constexpr int kSide = 31;

struct Scene {
  test::Wedge wedge;
  std::vector<double> share;
};

/// Wedges of 50 to 130 degrees in any direction, apex anywhere within the middle pixel.
std::vector<Scene> random_scenes(int n, double blur_px, test::Random& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const test::WedgePainter painter(blur_px);
  std::vector<Scene> scenes;
  for (int i = 0; i < n; ++i) {
    Scene s;
    const double u0 = 15 + unit(random) - 0.5, v0 = 15 + unit(random) - 0.5, axis = 2 * std::numbers::pi * unit(random);
    s.wedge = {u0, v0, axis, (25 + 40 * unit(random)) * std::numbers::pi / 180};
    for (int v = 0; v < kSide; ++v)
      for (int u = 0; u < kSide; ++u) s.share.push_back(painter.share(s.wedge, u, v));
    scenes.push_back(s);
  }
  return scenes;
}

struct Figures {
  int failed{0};
  double rms_px{0};   ///< per axis
  double nees{0};     ///< mean of e^T cov^-1 e; 2 for a perfect covariance
};

/// 12-bit images: background 1000, contrast as given, white noise; the start is off by up to a pixel in each axis.
Figures monte_carlo(const std::vector<Scene>& scenes, double contrast, double noise, test::Random& random,
                    const SubpixelConfig& config = {}) {
  std::normal_distribution<double> gauss(0, noise);
  std::uniform_int_distribution<int> off(-1, 1);
  SubpixelRefiner refiner(config);
  Figures f;
  double square = 0, nees = 0;
  for (const Scene& s : scenes) {
    test::Image image(kSide, kSide, PixelFormat::kMono12);
    image.fill([&](int u, int v) {
      const double value = 1000 + contrast * s.share[static_cast<std::size_t>(v * kSide + u)] + gauss(random);
      return static_cast<int>(std::lround(std::clamp(value, 0.0, 4095.0)));
    });
    const auto r = refiner.refine(image.view(), 15 + off(random), 15 + off(random), noise * noise + 1.0 / 12);
    if (!r.converged) {
      ++f.failed;
      continue;
    }
    const Vec2 e = r.uv_px - Vec2(s.wedge.u, s.wedge.v);
    square += e.squaredNorm();
    nees += e.dot(r.cov_px2.inverse() * e);
  }
  const double n = static_cast<double>(scenes.size()) - f.failed;
  f.rms_px = std::sqrt(square / n / 2);
  f.nees = nees / n;
  return f;
}

TEST(Subpixel, FindsAntiAliasedCornersToATenthOfAPixelPerAxis) {
  test::Random random(1);
  const auto scenes = random_scenes(500, 0.5, random);
  const Figures f = monte_carlo(scenes, 1500, 15, random);
  RecordProperty("rms_px", std::to_string(f.rms_px));
  std::printf("    contrast/noise 100, blur 0.5 px: rms %.3f px per axis, %d of 500 not converged\n", f.rms_px, f.failed);
  EXPECT_LT(f.rms_px, 0.13);
  EXPECT_EQ(f.failed, 0);
}

TEST(Subpixel, CovarianceIsConsistentOverContrastAndBlur) {
  // NEES of 2 is perfect. Above 2 the covariance promises too much; well below it gives information away.
  test::Random random(2);
  for (double blur : {0.0, 0.5, 0.8}) {
    const auto scenes = random_scenes(400, blur, random);
    for (double ratio : {4.0, 8.0, 16.0, 32.0, 100.0}) {
      const Figures f = monte_carlo(scenes, 12 * ratio, 12, random);
      std::printf("    blur %.1f px, contrast/noise %5.0f: rms %.3f px per axis, NEES %.2f, %3d of 400 not converged\n", blur, ratio,
                  f.rms_px, f.nees, f.failed);
      EXPECT_GT(f.nees, 0.4);
      EXPECT_LT(f.nees, ratio < 8 ? 3.8 : 2.2);
      EXPECT_LT(f.failed, ratio < 8 ? 120 : 10);  // lost in noise: the pixel's centre is reported instead
    }
  }
}

TEST(Subpixel, ACheckerboardCrossingIsFoundWithoutBias) {
  // GIVEN a saddle, symmetric about its centre, so that blur pulls to no side
  const test::WedgePainter painter(0.6);
  test::Random random(3);
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  SubpixelRefiner refiner({});
  Vec2 sum(0, 0);
  double square = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const double u0 = 15 + unit(random), v0 = 15 + unit(random), axis = 6 * unit(random);
    test::Image image(kSide, kSide, PixelFormat::kMono16);
    image.fill([&](int u, int v) {
      return static_cast<int>(4000 + 20000 * (painter.share({u0, v0, axis, std::numbers::pi / 4}, u, v) +
                                              painter.share({u0, v0, axis + std::numbers::pi, std::numbers::pi / 4}, u, v)));
    });
    const auto r = refiner.refine(image.view(), 15, 15, 4);
    ASSERT_TRUE(r.converged);
    const Vec2 e = r.uv_px - Vec2(u0, v0);
    sum += e;
    square += e.squaredNorm();
  }
  EXPECT_LT((sum / 50).norm(), 0.01);
  EXPECT_LT(std::sqrt(square / 100), 0.03);  // per axis
}

TEST(Subpixel, AnEdgeAndAFlatAreaDoNotConverge) {
  test::Image edge(kSide, kSide, PixelFormat::kMono8), flat(kSide, kSide, PixelFormat::kMono8);
  const test::WedgePainter painter(0.6);
  edge.fill([&](int u, int v) { return static_cast<int>(20 + 180 * painter.share({15.2, 14.9, 0.4, std::numbers::pi / 2}, u, v)); });
  flat.fill([](int, int) { return 100; });
  SubpixelRefiner refiner({});
  EXPECT_FALSE(refiner.refine(edge.view(), 15, 15, 1).converged);
  EXPECT_FALSE(refiner.refine(flat.view(), 15, 15, 1).converged);
}

TEST(Subpixel, AWindowThatLeavesTheImageDoesNotConverge) {
  test::Random random(4);
  const auto image = test::random_image(kSide, kSide, PixelFormat::kMono8, random);
  SubpixelRefiner refiner({});
  for (int v = 0; v < kSide; ++v)
    for (int u = 0; u < kSide; ++u) {
      const auto r = refiner.refine(image.view(), u, v, 1);
      EXPECT_FALSE(r.converged && std::min({u, v, kSide - 1 - u, kSide - 1 - v}) < refiner.reach());
    }
}

TEST(Subpixel, DoesNotDependOnTheUnitOfTheCounts) {
  test::Random random(5);
  const auto scene = random_scenes(1, 0.5, random)[0];
  test::Image narrow(kSide, kSide, PixelFormat::kMono8), wide(kSide, kSide, PixelFormat::kMono16);
  narrow.fill([&](int u, int v) { return static_cast<int>(30 + 180 * scene.share[static_cast<std::size_t>(v * kSide + u)]); });
  wide.fill([&](int u, int v) { return 256 * narrow.get(u, v); });
  SubpixelRefiner refiner({});
  const auto a = refiner.refine(narrow.view(), 15, 15, 4), b = refiner.refine(wide.view(), 15, 15, 4 * 65536.0);
  ASSERT_TRUE(a.converged);
  EXPECT_EQ(a.uv_px, b.uv_px);
  EXPECT_LT((a.cov_px2 - b.cov_px2).norm(), 1e-9);
}

TEST(Subpixel, EveryWindowSizeWorks) {
  test::Random random(6);
  const auto scenes = random_scenes(200, 0.5, random);
  for (int window = 2; window <= SubpixelConfig::kMaxWindow; ++window) {
    SubpixelConfig config;
    config.window_px = window;
    const Figures f = monte_carlo(scenes, 1500, 15, random, config);
    std::printf("    window %d: rms %.3f px per axis, NEES %.2f\n", window, f.rms_px, f.nees);
    EXPECT_LT(f.rms_px, 0.25);
    EXPECT_LT(f.failed, 5);
  }
}

}  // namespace
}  // namespace cyclops
