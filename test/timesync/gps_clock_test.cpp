#include "timesync/gps_clock.hpp"

#include <gtest/gtest.h>

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
  EXPECT_EQ(clock.sigma().ns, 1000);
  const GpsTime t{1'450'000'777'000'000'001};
  EXPECT_EQ(clock.to_gps(clock.to_service(t)), t);
}

TEST(GpsClock, LaterMarksVerifyAndDoNotMoveTheMapping) {
  GpsClock clock({});
  clock.on_mark(mark(0));
  for (int s = 1; s < 100; ++s) EXPECT_FALSE(clock.on_mark(mark(s, s % 2 == 0 ? 900 : -900)));
  EXPECT_EQ(clock.offset().ns, kOffset);
  EXPECT_EQ(clock.counters().contradictions, 0U);
}

TEST(GpsClock, SigmaSaysHowFarTheLastMarkWasOff) {
  GpsClock clock({});
  clock.on_mark(mark(0));
  clock.on_mark(mark(1, 150'000));
  EXPECT_EQ(clock.sigma().ns, 150'000);
  clock.on_mark(mark(2, 10));
  EXPECT_EQ(clock.sigma().ns, 1000);
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

TEST(GpsClock, ThreeContradictionsThatAgreeLockAnew) {
  GpsClock clock({});
  clock.on_mark(mark(0));
  EXPECT_FALSE(clock.on_mark(mark(1, kSecond)));
  EXPECT_FALSE(clock.on_mark(mark(2, kSecond + 500)));
  EXPECT_TRUE(clock.on_mark(mark(3, kSecond + 700)));
  EXPECT_EQ(clock.offset().ns, kOffset + kSecond + 700);
  EXPECT_EQ(clock.counters().relocks, 1U);
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
  EXPECT_EQ(clock.sigma().ns, 20'000'000);
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
  EXPECT_TRUE(GpsClockConfig::read(time).value().use_arrival);
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
