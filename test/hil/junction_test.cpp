// The fit that measures rendered corners: images are sampled 24 x 24 a pixel, not by the fit's own areas.
#include "hil/junction.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace cyclops::hil {
namespace {

constexpr int kSide = 25;
constexpr double kDeg = 3.14159265358979323846 / 180;

std::vector<float> sampled(const std::function<double(double, double)>& level) {
  constexpr int kSamples = 24;
  std::vector<float> out;
  for (int v = 0; v < kSide; ++v)
    for (int u = 0; u < kSide; ++u) {
      double sum = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) sum += level(u - 0.5 + (i % kSamples + 0.5) / kSamples, v - 0.5 + (i / kSamples + 0.5) / kSamples);
      out.push_back(static_cast<float>(sum / (kSamples * kSamples)));
    }
  return out;
}

/// Levels of the sectors that begin at ascending angles about an apex.
std::vector<float> star(const Vec2& apex, const std::vector<double>& from_deg, const std::vector<double>& level) {
  return sampled([&](double u, double v) {
    double a = std::atan2(v - apex.y(), u - apex.x()) / kDeg;
    if (a < from_deg.front()) a += 360;
    std::size_t i = from_deg.size() - 1;
    while (a < from_deg[i]) --i;
    return level[i];
  });
}

std::optional<Junction> fitted(const std::vector<float>& image) { return fit_junction(image, kSide, kSide, {12, 12}); }

TEST(Junction, FindsTheApexOfTwoThreeAndFourRays) {
  const Vec2 apex(13.3, 11.6);
  struct Case { std::vector<double> from_deg, level; };
  for (const Case& c : {Case{{20, 95}, {0.8, 0.1}}, Case{{-10, 140}, {0.2, 0.7}}, Case{{10, 120, 230}, {0.1, 0.8, 0.4}}, Case{{0, 90, 180}, {0.7, 0.2, 0.9}}, Case{{15, 100, 200, 290}, {0.1, 0.9, 0.3, 0.6}}}) {
    const auto found = fitted(star(apex, c.from_deg, c.level));
    ASSERT_TRUE(found) << c.from_deg.size() << " rays from " << c.from_deg[0];
    EXPECT_EQ(found->rays, static_cast<int>(c.from_deg.size()));
    EXPECT_LT((found->apex_px - apex).norm(), 0.02) << c.from_deg.size() << " rays from " << c.from_deg[0];
    EXPECT_LT(found->sigma_px, 0.02);
  }
}

TEST(Junction, AStraightEdgeHasNone) {
  for (const double slope : {0.0, 0.05, 0.13, 0.3, 0.9})
    for (const double at : {12.0, 12.2, 12.37})
      EXPECT_FALSE(fitted(sampled([&](double u, double v) { return v - at > slope * (u - 12) ? 0.8 : 0.1; }))) << slope << " " << at;
}

TEST(Junction, AStripeOrACurveHasNone) {
  EXPECT_FALSE(fitted(sampled([](double u, double) { return std::fabs(u - 12.2) < 1.7 ? 0.1 : 0.8; })));
  EXPECT_FALSE(fitted(sampled([](double u, double v) { return std::hypot(u - 12, v - 8) < 5 ? 0.1 : 0.8; })));
}

TEST(Junction, AnEvenWindowOrOneOutsideTheImageHasNone) {
  EXPECT_FALSE(fitted(std::vector<float>(kSide * kSide, 0.5F)));
  EXPECT_FALSE(fit_junction(star({12, 12}, {20, 95}, {0.8, 0.1}), kSide, kSide, {3, 12}));
}

TEST(Junction, ACornerNearTheEndOfTheWindowIsNotTakenForTheOneAsked) {
  EXPECT_FALSE(fitted(star({18, 12}, {20, 95}, {0.8, 0.1})));
}

}  // namespace
}  // namespace cyclops::hil
