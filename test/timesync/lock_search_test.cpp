#include "timesync/lock_search.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace cyclops {
namespace {

constexpr Duration kPeriod{33'000'000};
constexpr LockGates kGates{{}, Duration{26'000'000}, Duration{500'000}, Duration{1'000'000}};

// Four frames exposed at 0, 1, 2, 3 periods; exposure 4 ms, arriving `transport` after it; camera clock 1000 s ahead.
std::vector<LockFrame> frames(Duration transport) {
  std::vector<LockFrame> out;
  for (int j = 0; j < 4; ++j) {
    const std::int64_t t = j * kPeriod.ns;
    out.push_back({static_cast<std::uint64_t>(j + 1), 1'000'000'000'000 + t, Time{t + 4'000'000 + transport.ns}, Duration{4'000'000}});
  }
  return out;
}
EdgeRing edges(int from, int to) {
  EdgeRing out;
  for (int i = from; i < to; ++i) out.push({Time{i * kPeriod.ns}, -1, true});
  return out;
}
LockCandidates find(const std::vector<LockFrame>& f, const EdgeRing& e, const LockGates& gates = kGates) {
  LockCandidates out;
  find_locks(f, e, kPeriod, gates, out);
  return out;
}

TEST(LockSearch, FindsTheOneNumberThatArrivalsAllow) {
  for (const std::int64_t transport : {0, 5'000'000, 25'000'000}) {
    const auto found = find(frames(Duration{transport}), edges(-3, 6));
    ASSERT_EQ(found.size(), 1U) << transport;
    EXPECT_EQ(found[0].edge_minus_tick.ns, -1'000'000'000'000);
    EXPECT_EQ(found[0].edge[0], 3U);
  }
}

TEST(LockSearch, TellsSeveralNumbersWhenTheTransportMayTakeLongerThanAPeriod) {
  LockGates wide = kGates;
  wide.transport_max = Duration{60'000'000};
  EXPECT_EQ(find(frames(Duration{5'000'000}), edges(-5, 6), wide).size(), 2U);
}

TEST(LockSearch, AFrameWithoutEdgeAllowsNoLock) {
  EdgeRing e;
  for (const int i : {-1, 0, 1, 3, 4}) e.push({Time{i * kPeriod.ns}, -1, true});
  EXPECT_TRUE(find(frames(Duration{5'000'000}), e).empty());
}

TEST(LockSearch, TheFirstOfTwoBouncesIsTheEdge) {
  EdgeRing e;
  for (int i = -1; i < 5; ++i) for (const int bounce : {0, 2'000'000}) e.push({Time{i * kPeriod.ns + bounce}, -1, true});
  const auto found = find(frames(Duration{5'000'000}), e);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].edge_minus_tick.ns, -1'000'000'000'000);
}

TEST(LockSearch, EdgesAfterTheLastArrivalPlayNoPart) {
  const auto f = frames(Duration{5'000'000});
  const auto few = find(f, edges(-3, 4)), many = find(f, edges(-3, 40));
  ASSERT_EQ(few.size(), many.size());
  EXPECT_EQ(few[0].edge, many[0].edge);
}

TEST(LockSearch, QuietFramesGiveThePeriodOfTheCamera) {
  EXPECT_EQ(quiet_period(frames(Duration{5'000'000}), 0.3, kGates.residual), kPeriod);
}

TEST(LockSearch, FramesThatArriveInABurstProveNothing) {
  auto f = frames(Duration{5'000'000});
  for (LockFrame& each : f) each.arrival = f.back().arrival;
  EXPECT_EQ(quiet_period(f, 0.3, kGates.residual).ns, 0);
}

TEST(LockSearch, FramesWhoseNumbersAndTicksDisagreeProveNothing) {
  auto f = frames(Duration{5'000'000});
  f[2].number += 1;
  f[3].number += 1;
  EXPECT_EQ(quiet_period(f, 0.3, kGates.residual).ns, 0);
}

}  // namespace
}  // namespace cyclops
