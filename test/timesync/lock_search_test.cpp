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
  // GIVEN a frame that arrives 0.1 ms after its own edge, which is lost, and another edge 0.5 ms after that
  // THEN there is no lock, whether the other edge has been seen already or not
  auto f = frames({});
  for (LockFrame& each : f) {
    each.exposure = Duration{100'000};
    each.arrival = each.arrival - Duration{3'900'000};
  }
  EdgeRing e = edges(-1, 3);
  EXPECT_TRUE(find(f, e).empty());
  e.push({Time{3 * kPeriod.ns + 500'000}, -1, true});
  EXPECT_TRUE(find(f, e).empty());
}

TEST(LockSearch, OneLateFrameDoesNotAllowALaterEdge) {
  auto f = frames(Duration{5'000'000});
  f[3].arrival = f[3].arrival + kPeriod;
  const auto found = find(f, edges(-3, 8));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].edge_minus_tick.ns, -1'000'000'000'000);
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
