#include "detect/pixel_noise.hpp"

#include <gtest/gtest.h>

#include "test/detect/images.hpp"

namespace cyclops {
namespace {

TEST(PixelNoise, IsFoundBesideTextureInAnyFormat) {
  test::Random random(33);
  for (PixelFormat format : {PixelFormat::kMono8, PixelFormat::kMono10, PixelFormat::kMono12, PixelFormat::kMono16}) {
    const double counts = (1 << bits_per_pixel(format)) / 4096.0;
    for (double noise : {16.0, 30.0, 60.0}) {
      const auto image = test::sky_with_wedges(61, {{30, 30, 0.5, 0.8}}, noise, random, format);
      const double sigma = std::sqrt(estimate_noise_variance(image.view(), {0, 0, 61, 61}, nullptr));
      const double truth = std::hypot(noise * counts, std::sqrt(1.0 / 12));
      EXPECT_NEAR(sigma / truth, 1, 0.2) << noise << " " << bits_per_pixel(format);
    }
  }
}

TEST(PixelNoise, OfAConstantImageIsTheRounding) {
  const auto image = test::step_corner_21();
  EXPECT_NEAR(estimate_noise_variance(image.view(), {0, 0, 21, 21}, nullptr), 1.0 / 12, 1e-12);
  EXPECT_NEAR(estimate_noise_variance(image.view(), {4, 4, 6, 6}, nullptr), 1.0 / 12, 1e-12);
}

}  // namespace
}  // namespace cyclops
