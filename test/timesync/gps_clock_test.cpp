#include "timesync/gps_clock.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "test/support.hpp"

namespace cyclops {
namespace {

constexpr std::int64_t kOffset = -1'450'000'000'123'456'789;
constexpr std::int64_t kSecond = 1'000'000'000;

TimeMark mark(std::int64_t second, std::int64_t error_ns = 0, std::int64_t sigma_ns = 1000) {
  const GpsTime gps{1'450'000'010 * kSecond + second * kSecond};
  return {Time{gps.ns + kOffset + error_ns}, gps, Duration{sigma_ns}};
}

TEST(GpsClock, IsNotValidBeforeAnythingHasCome) {
  const GpsClock clock({});
  EXPECT_FALSE(clock.valid());
  EXPECT_EQ(clock.source(), GpsSource::kNone);
}

TEST(GpsClock, TheFirstMarkLocksAnOffsetThatIsExactBothWays) {
  GpsClock clock({});
  EXPECT_TRUE(clock.on_mark(mark(0)));
  EXPECT_EQ(clock.source(), GpsSource::kTimeMark);
  EXPECT_EQ(clock.offset().ns, kOffset);
  const GpsTime t{1'450'000'777'000'000'001};
  EXPECT_EQ(clock.to_gps(clock.to_service(t)), t);
}

TEST(GpsClock, MarksWithoutDriftNeverMoveTheMapping) {
  GpsClock clock({});
  for (int s = 0; s < 100; ++s) EXPECT_EQ(clock.on_mark(mark(s)), s == 0);
  for (const std::int64_t ns : {1'450'000'000'000'000'000, 1'450'000'055'123'456'789, 1'450'009'999'999'999'999}) EXPECT_EQ(clock.to_service(GpsTime{ns}).ns, ns + kOffset);
  EXPECT_EQ(clock.counters().contradictions, 0U);
}

TEST(GpsClock, FollowsTheDriftAndSaysIt) {
  // GIVEN a service clock that gains 40 us a second on GPS, and marks with 10 us of scatter
  test::Random random(3);
  std::normal_distribution<double> noise(0, 10'000);
  GpsClock clock({});
  for (int s = 0; s < 120; ++s) EXPECT_EQ(clock.on_mark(mark(s, s * 40'000 + std::llround(noise(random)), 5'000)), s == 0);
  EXPECT_NEAR(clock.drift_ppm(), 40, 1);
  EXPECT_LE(clock.drift_sigma_ppm(), 1);
  const TimeMark later = mark(121, 121 * 40'000);
  EXPECT_LE(std::llabs((clock.to_service(later.t_gps) - later.t).ns), 15'000);
  EXPECT_LE(std::llabs((clock.to_gps(clock.to_service(later.t_gps)) - later.t_gps).ns), 1);
}

TEST(GpsClock, WithoutMarksTheLineIsCarriedOnWithItsAgeAndAGrowingSigma) {
  GpsClock clock({});
  for (int s = 0; s < 300; ++s) clock.on_mark(mark(s, s * 40'000));
  const TimeMark soon = mark(301, 301 * 40'000), late = mark(359, 359 * 40'000);
  EXPECT_LE(std::llabs((clock.to_service(late.t_gps) - late.t).ns), 100);
  EXPECT_GT(clock.sigma_at(late.t), clock.sigma_at(soon.t) * 5);
  EXPECT_LT(clock.sigma_at(late.t).ns, 100'000);
  EXPECT_NEAR(clock.age_at(late.t).seconds(), 60, 0.01);
  EXPECT_EQ(clock.age_at(mark(100).t).ns, 0);
}

TEST(GpsClock, TheSigmaOfAMarkDoesNotAverageAway) {
  GpsClock clock({});
  for (int s = 0; s < 300; ++s) clock.on_mark(mark(s, 0, 20'000));
  EXPECT_GE(clock.sigma_at(mark(300).t).ns, 20'000);
}

TEST(GpsClock, AStampIsMappedTheSameWhetherTheNextMarkHasComeOrNot) {
  GpsClock early({}), late({});
  for (int s = 0; s < 50; ++s) {
    const TimeMark m = mark(s, (s * 7919) % 30'000);
    late.on_mark(m);
    const GpsTime t = m.t_gps + Duration{300'000'000};   // before any mark after m can rule
    if (s > 0) { EXPECT_EQ(early.to_service(t), late.to_service(t)) << s; }
    early.on_mark(m);
  }
}

TEST(GpsClock, OneOutlierIsCountedAndIgnored) {
  GpsClock clock({});
  clock.on_mark(mark(0));
  EXPECT_FALSE(clock.on_mark(mark(1, kSecond)));
  EXPECT_FALSE(clock.on_mark(mark(2)));
  EXPECT_FALSE(clock.on_mark(mark(3, kSecond)));
  EXPECT_FALSE(clock.on_mark(mark(4, kSecond)));
  EXPECT_EQ(clock.offset().ns, kOffset);
  EXPECT_EQ(clock.counters().contradictions, 3U);
}

TEST(GpsClock, ThreeContradictionsThatAgreeLockAnewAndTheDriftIsKept) {
  GpsClock clock({});
  for (int s = 0; s < 60; ++s) clock.on_mark(mark(s, s * 40'000));
  const double drift = clock.drift_ppm();
  EXPECT_FALSE(clock.on_mark(mark(60, 5'000'000)));
  EXPECT_FALSE(clock.on_mark(mark(61, 5'040'500)));
  EXPECT_TRUE(clock.on_mark(mark(62, 5'080'700)));
  EXPECT_EQ(clock.offset().ns, kOffset + 5'080'700);
  EXPECT_EQ(clock.drift_ppm(), drift);
  EXPECT_EQ(clock.counters().relocks, 1U);
  EXPECT_EQ(clock.counters().whole_second_steps, 0U);
}

TEST(GpsClock, AStepByWholeSecondsIsBelievedOnlyAfterTen) {
  // GIVEN a source of marks that takes a leap second for real
  GpsClock clock({});
  clock.on_mark(mark(0));
  for (int s = 1; s < 10; ++s) EXPECT_FALSE(clock.on_mark(mark(s, -kSecond))) << s;
  EXPECT_TRUE(clock.on_mark(mark(10, -kSecond)));
  EXPECT_EQ(clock.counters().whole_second_steps, 1U);
}

TEST(GpsClock, AFlightThatBeginsAnewIsFollowedAfterThreeMarks) {
  GpsClock clock({});
  for (int s = 0; s < 20; ++s) clock.on_mark(mark(s));
  for (int s = 0; s < 2; ++s) EXPECT_FALSE(clock.on_mark(mark(s, 77'000'000)));
  EXPECT_TRUE(clock.on_mark(mark(2, 77'000'000)));
  EXPECT_EQ(clock.to_service(mark(5).t_gps), mark(5, 77'000'000).t);
}

TEST(GpsClock, ContradictionsThatDisagreeDoNotLock) {
  GpsClock clock({});
  clock.on_mark(mark(0));
  for (int s = 1; s < 20; ++s) EXPECT_FALSE(clock.on_mark(mark(s, s * kSecond)));
  EXPECT_EQ(clock.offset().ns, kOffset);
}

TEST(GpsClock, AMarkWithoutSigmaIsRefused) {
  GpsClock clock({});
  EXPECT_FALSE(clock.on_mark(mark(0, 0, 0)));
  EXPECT_FALSE(clock.valid());
  EXPECT_EQ(clock.counters().refused, 1U);
}

TEST(GpsClock, WithoutMarksTheFastestArrivalServesAndSaysTwentyMilliseconds) {
  GpsClockConfig config;
  config.use_arrival = true;
  GpsClock clock(config);
  for (const std::int64_t late : {9'000'000, 3'000'000, 7'000'000}) {
    const TimeMark m = mark(0, late);
    clock.on_arrival(m.t, m.t_gps);
  }
  EXPECT_EQ(clock.source(), GpsSource::kArrival);
  EXPECT_EQ(clock.offset().ns, kOffset + 3'000'000);
  EXPECT_EQ(clock.sigma_at(mark(3).t).ns, 20'000'000);
}

TEST(GpsClock, ArrivalIsNotUsedUnlessTheRigSaysSo) {
  GpsClock clock({});
  EXPECT_FALSE(clock.on_arrival(mark(0).t, mark(0).t_gps));
  EXPECT_FALSE(clock.valid());
}

TEST(GpsClock, AMarkReplacesTheArrivalAndNoArrivalReplacesAMark) {
  GpsClockConfig config;
  config.use_arrival = true;
  GpsClock clock(config);
  clock.on_arrival(mark(0, 5'000'000).t, mark(0).t_gps);
  EXPECT_TRUE(clock.on_mark(mark(1)));
  EXPECT_FALSE(clock.on_arrival(mark(2, -50'000'000).t, mark(2).t_gps));
  EXPECT_EQ(clock.offset().ns, kOffset);
}

TEST(GpsClock, TheOffsetByArrivalSettlesAndThenOnlyAContradictionMovesIt) {
  GpsClockConfig config;
  config.use_arrival = true;
  GpsClock clock(config);
  const auto arrive = [&](int s, std::int64_t late) { return clock.on_arrival(mark(s, late).t, mark(s).t_gps); };
  for (int s = 0; s < 100; ++s) arrive(s, 4'000'000 + s * 1000);
  EXPECT_FALSE(arrive(100, 3'000'000));            // a little faster: settled, does not creep
  EXPECT_EQ(clock.offset().ns, kOffset + 4'000'000);
  for (int s = 101; s < 200; ++s) EXPECT_FALSE(arrive(s, 2 * kSecond));
  EXPECT_TRUE(arrive(200, 2 * kSecond));           // a hundred in a row far too late: the clock was stepped
  EXPECT_EQ(clock.offset().ns, kOffset + 2 * kSecond);
  EXPECT_EQ(clock.counters().arrival_relocks, 1U);
}

TEST(GpsClock, ReadsWhereGpsTimeComesFrom) {
  auto file = ConfigFile::parse("[time]\ngps_from = \"arrival\"\n", "rig.toml").value();
  ConfigTable time = file.root().table("time");
  const GpsClockConfig config = GpsClockConfig::read(time).value();
  EXPECT_TRUE(config.use_arrival);
  EXPECT_FALSE(config.use_pps);
  EXPECT_TRUE(file.finish().ok());
}

TEST(GpsClock, UsesNoHeap) {
  GpsClock clock({});
  const test::HeapGuard guard;
  for (int s = 0; s < 100; ++s) clock.on_mark(mark(s));
  EXPECT_EQ(guard.count(), 0U);
}

}  // namespace
}  // namespace cyclops
