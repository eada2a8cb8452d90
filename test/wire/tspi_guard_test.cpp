#include "wire/tspi_guard.hpp"

#include <gtest/gtest.h>

#include "test/wire/examples.hpp"

namespace cyclops {
namespace {

/// The n-th report of a flying tanker at 50 Hz.
TspiReport report(std::uint32_t n) {
  TspiReport r = test::good_report();
  r.seq = n;
  r.t_gps = {1'000'000'000'000 + 20'000'000LL * n};
  r.latitude_deg += 3e-5 * n;
  return r;
}
Time arrival(std::uint32_t n) { return {20'000'000LL * n}; }

TEST(TspiGuard, PassesAFlyingAircraft) {
  TspiGuard guard(Aircraft::kTanker);
  for (std::uint32_t n = 0; n < 500; ++n) EXPECT_EQ(guard.check(report(n), arrival(n)), TspiVerdict::kPass);
  EXPECT_EQ(guard.counters().passed, 500u);
  EXPECT_EQ(guard.counters().seq_skipped + guard.counters().seq_back + guard.counters().time_back, 0u);
}

TEST(TspiGuard, RefusesTheOtherAircraft) {
  TspiGuard guard(Aircraft::kReceiver);
  EXPECT_EQ(guard.check(report(0), arrival(0)), TspiVerdict::kWrongAircraft);
  EXPECT_EQ(guard.counters().wrong_aircraft, 1u);
}

TEST(TspiGuard, RefusesAStateThatStandsStillWhileItsTimeGoesOn) {
  TspiGuard guard(Aircraft::kTanker);
  int passed = 0;
  for (std::uint32_t n = 0; n < 20; ++n) {
    TspiReport r = report(0);
    r.seq = n;
    r.t_gps = report(n).t_gps;
    if (guard.check(r, arrival(n)) == TspiVerdict::kPass) ++passed;
  }
  EXPECT_EQ(passed, 6);  // the first and five repetitions
  EXPECT_EQ(guard.counters().frozen, 14u);
  EXPECT_EQ(guard.check(report(21), arrival(21)), TspiVerdict::kPass);
}

TEST(TspiGuard, LetsAParkedAircraftStand) {
  TspiGuard guard(Aircraft::kTanker);
  for (std::uint32_t n = 0; n < 50; ++n) {
    TspiReport r = report(0);
    r.velocity_ned_mps.setZero();
    r.t_gps = report(n).t_gps;
    EXPECT_EQ(guard.check(r, arrival(n)), TspiVerdict::kPass);
  }
}

TEST(TspiGuard, LimitsTheRateOverOneSecondOfArrivals) {
  TspiGuard guard(Aircraft::kTanker);
  for (std::uint32_t n = 0; n < 1000; ++n) guard.check(report(n), Time{1000 * static_cast<std::int64_t>(n)});
  EXPECT_EQ(guard.counters().passed, 400u);
  EXPECT_EQ(guard.counters().too_many, 600u);
  EXPECT_EQ(guard.check(report(1001), Time{2'000'000'000}), TspiVerdict::kPass);
}

TEST(TspiGuard, CountsTimesAndNumbersThatRepeatSkipOrGoBack) {
  TspiGuard guard(Aircraft::kTanker);
  for (std::uint32_t n : {0u, 1u, 4u, 3u, 3u}) guard.check(report(n), arrival(5));
  TspiReport degraded = report(9);
  degraded.degraded = true;
  guard.check(degraded, arrival(9));
  EXPECT_EQ(guard.counters().seq_skipped, 2u);
  EXPECT_EQ(guard.counters().seq_back, 2u);
  EXPECT_EQ(guard.counters().time_back, 1u);
  EXPECT_EQ(guard.counters().time_repeated, 1u);
  EXPECT_EQ(guard.counters().degraded, 1u);
}

}  // namespace
}  // namespace cyclops
