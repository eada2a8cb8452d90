#include "timesync/tick_line.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "test/support.hpp"

namespace cyclops {
namespace {

constexpr std::int64_t kPeriod = 33'333'333;
constexpr double kRate = 40e-6;

Time truth(std::int64_t tick) { return Time{7'000'000'000'000 + tick + std::llround(kRate * static_cast<double>(tick))}; }

TEST(TickLine, OnePairGivesTheOffset) {
  TickLine line({});
  line.add(1000, Time{5000});
  EXPECT_EQ(line.at(1500).ns, 5500);
}

TEST(TickLine, FindsTheRateOfTheCameraClock) {
  TickLine line({});
  for (std::int64_t i = 0; i < 64; ++i) line.add(i * kPeriod, truth(i * kPeriod));
  EXPECT_NEAR(line.rate_ppm(), 40, 0.05);
  EXPECT_LE(std::llabs((line.at(100 * kPeriod) - truth(100 * kPeriod)).ns), 20);
}

TEST(TickLine, StaysWithinThreeSigmaWhenTheEdgesStop) {
  test::Random random(3);
  std::normal_distribution<double> noise(0, 30'000);
  TickLine line({});
  for (std::int64_t i = 0; i < 64; ++i) line.add(i * kPeriod, truth(i * kPeriod) + Duration{std::llround(noise(random))});
  for (const std::int64_t later : {64, 120, 360}) {
    const std::int64_t error = (line.at(later * kPeriod) - truth(later * kPeriod)).ns;
    EXPECT_LE(std::llabs(error), 3 * line.sigma_at(later * kPeriod).ns) << later;
  }
}

TEST(TickLine, OneOutlierDoesNotBendIt) {
  TickLine line({});
  for (std::int64_t i = 0; i < 64; ++i) line.add(i * kPeriod, truth(i * kPeriod) + Duration{i == 40 ? 900'000 : 0});
  EXPECT_LE(std::llabs((line.at(64 * kPeriod) - truth(64 * kPeriod)).ns), 100);
}

TEST(TickLine, KeepsTheRateWhenOnlyThePairsAreForgotten) {
  TickLine line({});
  for (std::int64_t i = 0; i < 64; ++i) line.add(i * kPeriod, truth(i * kPeriod));
  line.clear_pairs();
  EXPECT_FALSE(line.valid());
  EXPECT_NEAR(line.rate_ppm(), 40, 0.01);
  line.clear();
  EXPECT_EQ(line.rate_ppm(), 0);
}

TEST(TickLine, NeverBelievesMoreThanTheLargestRate) {
  ClockNoise slow;
  slow.largest_rate = 20e-6;
  TickLine line(slow);
  for (std::int64_t i = 0; i < 64; ++i) line.add(i * kPeriod, truth(i * kPeriod));
  EXPECT_NEAR(line.rate_ppm(), 20, 1e-9);
}

}  // namespace
}  // namespace cyclops
