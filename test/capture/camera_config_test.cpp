#include "capture/camera_config.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

TEST(CameraConfig, PatienceDoublesWithEveryStreamThatBroughtNothingUpToEightTimes) {
  CameraConfig c;
  c.frame_rate_hz = 100;
  c.watchdog_periods = 60;
  EXPECT_EQ(c.watchdog().ns, 600'000'000);
  const std::int64_t expected_ms[] = {600, 1200, 2400, 4800, 4800, 4800};
  for (int n = 0; n < 6; ++n) EXPECT_EQ(c.patience(n).ns, expected_ms[n] * 1'000'000) << n;
}

TEST(CameraConfig, TheWatchdogIsNeverShorterThanItsFloor) {
  CameraConfig c;
  c.frame_rate_hz = 100;
  c.watchdog_periods = 3;
  EXPECT_EQ(c.watchdog(), c.watchdog_least);
}

}  // namespace
}  // namespace cyclops
