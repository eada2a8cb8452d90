#include "timesync/pps_marks.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kGps = 1'450'000'000;          // s
constexpr std::int64_t kService = 77'123'456'789;     // service time of GPS second kGps, ns

class PpsMarksTest : public testing::Test {
 protected:
  static StrobeEdge edge(std::int64_t second, std::int64_t off_ns = 0) { return {Time{kService + second * kSecond + off_ns}, -1, true}; }
  static GpsTime rough(const StrobeEdge& e, std::int64_t late_ns = 40'000'000) { return {kGps * kSecond + e.t.ns - kService - late_ns}; }
  std::optional<TimeMark> give(const StrobeEdge& e) { return pps.on_edge(e, rough(e)); }
  static void expect(const std::optional<TimeMark>& m, std::int64_t second, std::int64_t off_ns = 0) {
    ASSERT_TRUE(m.has_value());
    EXPECT_EQ(m->t_gps.ns, (kGps + second) * kSecond);
    EXPECT_EQ(m->t.ns, kService + second * kSecond + off_ns);
  }
  PpsMarks pps{PpsConfig{}};
};

TEST_F(PpsMarksTest, TheSecondEdgeIsNumberedByTheRoughClockAndTheRestByCounting) {
  EXPECT_FALSE(give(edge(0)));
  expect(give(edge(1)), 1);
  for (int s = 2; s < 100; ++s) expect(pps.on_edge(edge(s), std::nullopt), s);
  EXPECT_EQ(pps.counters().marks, 99U);
}

TEST_F(PpsMarksTest, WithoutARoughClockThereIsNoMark) {
  for (int s = 0; s < 10; ++s) EXPECT_FALSE(pps.on_edge(edge(s), std::nullopt));
  EXPECT_EQ(pps.counters().unnumbered, 10U);
}

TEST_F(PpsMarksTest, ARoughTimeNearTheHalfSecondNumbersNothing) {
  for (int s = 0; s < 10; ++s) EXPECT_FALSE(pps.on_edge(edge(s), rough(edge(s), 480'000'000)));
}

TEST_F(PpsMarksTest, LostEdgesAreCountedAndTheNumberGoesOn) {
  for (int s = 0; s < 5; ++s) give(edge(s));
  expect(give(edge(65)), 65);
  EXPECT_EQ(pps.counters().missed, 60U);
}

TEST_F(PpsMarksTest, AGlitchAndABounceGiveNoMark) {
  for (int s = 0; s < 5; ++s) give(edge(s));
  EXPECT_FALSE(give(edge(4, 300'000)));
  EXPECT_FALSE(give(edge(4, 400'000'000)));
  expect(give(edge(5)), 5);
  EXPECT_EQ(pps.counters().spurious, 2U);
}

TEST_F(PpsMarksTest, AGlitchBeforeTheFirstEdgesIsNotTakenForASecond) {
  EXPECT_FALSE(give(edge(0, -300'000'000)));
  EXPECT_FALSE(give(edge(0)));
  expect(give(edge(1)), 1);
}

TEST_F(PpsMarksTest, AGridThatMovesIsNumberedAnew) {
  for (int s = 0; s < 5; ++s) give(edge(s));
  for (int s = 5; s < 10; ++s) EXPECT_FALSE(give(edge(s, 250'000'000)));
  expect(give(edge(10, 250'000'000)), 10, 250'000'000);
}

TEST_F(PpsMarksTest, AWrongSecondIsFoundByTheRoughClockAfterFive) {
  const auto wrong = [](const StrobeEdge& e) { return GpsTime{rough(e).ns + kSecond}; };
  for (int s = 0; s < 3; ++s) pps.on_edge(edge(s), wrong(edge(s)));
  for (int s = 3; s < 7; ++s) expect(give(edge(s)), s + 1, -kSecond);
  expect(give(edge(7)), 7);
  EXPECT_EQ(pps.counters().renumbered, 1U);
}

TEST_F(PpsMarksTest, TheDelayIsTakenOffAndTheOtherSlopeIgnored) {
  PpsConfig config;
  config.delay = Duration{250'000};
  config.delay_sigma = Duration{3'000};
  PpsMarks late(config);
  late.on_edge(edge(0, 250'000), rough(edge(0)));
  StrobeEdge falling = edge(0, 100'000'000);
  falling.rising = false;
  EXPECT_FALSE(late.on_edge(falling, rough(falling)));
  const auto m = late.on_edge(edge(1, 250'000), rough(edge(1)));
  expect(m, 1);
  EXPECT_EQ(m->sigma.ns, 3'000);
}

}  // namespace
}  // namespace cyclops
