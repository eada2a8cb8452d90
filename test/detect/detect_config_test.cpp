#include "detect/detect_config.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

TEST(DetectConfig, ModeChoosesTheDefaultsOfTheOtherKeys) {
  auto file = ConfigFile::parse("[detect]\nmode = \"thesis\"\nnms_radius_px = 4\n", "a.toml").value();
  auto table = file.root().table("detect");
  const auto config = DetectConfig::read(table, {}).value();
  EXPECT_TRUE(file.finish().ok());
  EXPECT_EQ(config.mode, DetectMode::kThesis);
  EXPECT_EQ(config.nms_radius_px, 4);
  EXPECT_EQ(config.saturation_counts, 0);
  EXPECT_EQ(config.subpixel_window_px, 0);
  EXPECT_EQ(config.floor_noise, 0);
}

TEST(DetectConfig, RefusesAnEvenWindow) {
  auto file = ConfigFile::parse("[detect]\ngaussian_size = 8\n", "a.toml").value();
  auto table = file.root().table("detect");
  (void)DetectConfig::read(table, {});
  EXPECT_EQ(file.finish().error().message(), "a.toml:2: detect.gaussian_size: is 8, expected an odd number");
}

}  // namespace
}  // namespace cyclops
