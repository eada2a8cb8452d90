#include "service/front.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace cyclops {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr GpsTime kGps{1'450'000'000 * kSecond};
constexpr Time kService{88 * kSecond + 5'555};

class FrontClocks : public testing::Test {
 protected:
  void make(bool pps, bool arrival = false) {
    GpsClockConfig gps;
    gps.use_pps = pps;
    gps.use_arrival = arrival;
    front = std::make_unique<Front>(FrameStamperConfig{}, gps, NavConfig{}, NavRig{}, PpsConfig{});
  }
  // Reports at 50 Hz that arrive 20 to 40 ms after their time, and an edge at each second; both clocks run alike.
  void fly(int from_s, int to_s, bool edges) {
    for (std::int64_t ms = from_s * 1000; ms < to_s * 1000; ms += 20) {
      const Duration since{ms * 1'000'000};
      if (edges && ms % 1000 == 0) front->push(PpsEdge{{kService + since, -1, true}});
      TspiReport r;
      r.seq = static_cast<std::uint32_t>(ms / 20);
      r.t_gps = kGps + since;
      r.latitude_deg = 35 + 1e-5 * static_cast<double>(ms);
      r.velocity_ned_mps = {0, 100, 0};
      front->push(r, kService + since + Duration::from_ms(20 + static_cast<double>(ms % 7) * 3));
    }
  }
  [[nodiscard]] std::int64_t off_ns(int second) const { return (*front->gps_time(kService + Duration{second * kSecond}) - kGps).ns - second * kSecond; }
  std::unique_ptr<Front> front;
};

TEST_F(FrontClocks, EdgesOfPpsAreNumberedByTheArrivalOfTspiAndThenGiveGpsTime) {
  make(true);
  fly(0, 1, true);
  EXPECT_EQ(front->gps().source(), GpsSource::kArrival) << "until there is a mark";
  EXPECT_GT(std::llabs(off_ns(1)), 15'000'000);
  fly(1, 20, true);
  EXPECT_EQ(front->gps().source(), GpsSource::kTimeMark);
  EXPECT_EQ(off_ns(19), 0);
  EXPECT_EQ(front->pps().marks, 19U) << "the first edge has none before it";
}

TEST_F(FrontClocks, WhatATimeMapsToDoesNotDependOnWhetherTheEdgeOfPpsCameBeforeOrAfterTheFrame) {
  // GIVEN edges of PPS that come at once, and the same that come 0.3 s late
  std::vector<std::int64_t> mapped[2];
  for (int late = 0; late < 2; ++late) {
    make(true);
    std::vector<PpsEdge> edges;
    for (int ms = 0; ms < 6000; ms += 20) {
      if (ms % 1000 == 0) edges.push_back({{kService + Duration::from_ms(ms) + Duration{700}, -1, true}});
      if (!edges.empty() && (late == 0 || ms % 1000 == 300)) {
        front->push(edges.back());
        edges.clear();
      }
      if (ms == 0) front->push(TimeMark{kService, kGps, Duration{1000}});
      mapped[late].push_back(front->gps_time(kService + Duration::from_ms(ms))->ns);
    }
    EXPECT_EQ(front->gps().source(), GpsSource::kTimeMark);
    EXPECT_GT(front->pps().marks, 3U);
  }
  EXPECT_EQ(mapped[0], mapped[1]);
  EXPECT_NE(mapped[0].front() - kGps.ns, mapped[0].back() - kGps.ns - 5'980'000'000) << "the edges are 700 ns late, the mark is not";
}

TEST_F(FrontClocks, WithoutPpsTheNextBestServes) {
  make(true);
  fly(0, 5, false);
  EXPECT_EQ(front->gps().source(), GpsSource::kArrival);
  front->push(TimeMark{kService, kGps, Duration{1000}});
  EXPECT_EQ(front->gps().source(), GpsSource::kTimeMark);
  EXPECT_EQ(off_ns(0), 0);
}

TEST_F(FrontClocks, EdgesOfPpsAreIgnoredUnlessTheRigWantsThem) {
  make(false);
  fly(0, 5, true);
  EXPECT_FALSE(front->gps().valid());
  EXPECT_EQ(front->pps().edges, 0U);
}

TEST_F(FrontClocks, LostPpsIsHoldoverWithItsAge) {
  make(true);
  fly(0, 60, true);
  FrameInfo f;
  f.status = FrameStatus::kComplete;
  f.t_arrival = kService + Duration{120 * kSecond};
  ASSERT_TRUE(front->push(f, 0));
  front->flush();
  const ClockState state = front->clocks();
  EXPECT_EQ(state.gps_source, GpsSource::kTimeMark);
  EXPECT_NEAR(state.gps_age.seconds(), 61, 0.5);
  EXPECT_GT(state.gps_sigma.ns, 20'000);
  EXPECT_LT(state.gps_sigma.ns, 200'000);
}

}  // namespace
}  // namespace cyclops
