#include "nav/tspi_buffer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "test/nav/flying.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

using test::at_ms;
using Kind = TspiBuffer::Kind;

Tspi sample(std::uint32_t seq, double ms) {
  test::Flyer f;
  f.turn_rps = 0.05;
  f.q_n_b = attitude<frame::R>({0.3, 0.1, 0.4}).quaternion();
  return f.at(Aircraft::kReceiver, seq, at_ms(ms));
}

std::vector<Tspi> stream(int n, double step_ms) {
  std::vector<Tspi> out;
  for (int i = 0; i < n; ++i) out.push_back(sample(static_cast<std::uint32_t>(i), i * step_ms));
  return out;
}

bool same(const AircraftState& a, const AircraftState& b) {
  return a.position.xyz == b.position.xyz && a.q_e_b.coeffs() == b.q_e_b.coeffs() && a.velocity_e == b.velocity_e &&
         a.rate_b == b.rate_b && a.position_cov_e == b.position_cov_e && a.attitude_cov_b == b.attitude_cov_b;
}

TEST(TspiBuffer, AnyOrderAndAnyRepetitionOfTheSameSamplesGivesTheSameBits) {
  const std::vector<Tspi> samples = stream(40, 20);
  TspiBuffer sorted{NavConfig{}};
  for (const Tspi& s : samples) sorted.push(s);
  test::Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    // GIVEN the same samples shuffled, some of them twice
    std::vector<Tspi> mixed = samples;
    for (int i = 0; i < 10; ++i) mixed.push_back(samples[random() % samples.size()]);
    std::shuffle(mixed.begin(), mixed.end(), random);
    TspiBuffer buffer{NavConfig{}};
    // WHEN they come in, THEN order and answers are those of the sorted stream
    for (const Tspi& s : mixed) buffer.push(s);
    ASSERT_EQ(buffer.size(), samples.size());
    EXPECT_EQ(buffer.counters().duplicate, 10u);
    for (double ms = 0; ms < 900; ms += 7.3) {
      const auto a = sorted.at(at_ms(ms)), b = buffer.at(at_ms(ms));
      ASSERT_EQ(a.kind, b.kind);
      ASSERT_EQ(a.age, b.age);
      ASSERT_TRUE(same(a.state, b.state)) << ms;
    }
  }
}

TEST(TspiBuffer, DropsASampleWithATimeOrANeighbouringSeqItAlreadyHas) {
  TspiBuffer buffer{NavConfig{}};
  EXPECT_EQ(buffer.push(sample(1, 0)), Admission::kAccepted);
  EXPECT_EQ(buffer.push(sample(2, 20)), Admission::kAccepted);
  EXPECT_EQ(buffer.push(sample(9, 20)), Admission::kDuplicate);
  EXPECT_EQ(buffer.push(sample(2, 21)), Admission::kDuplicate);
  EXPECT_EQ(buffer.push(sample(2, 19)), Admission::kDuplicate);
  EXPECT_EQ(buffer.counters().duplicate, 3u);
  EXPECT_EQ(buffer.size(), 2u);
}

TEST(TspiBuffer, CountsNumbersJumpedOverAndThoseThatComeLate) {
  TspiBuffer buffer{NavConfig{}};
  buffer.push(sample(1, 20));
  buffer.push(sample(5, 100));
  EXPECT_EQ(buffer.counters().seq_gap, 1u);
  EXPECT_EQ(buffer.counters().missing, 3u);
  EXPECT_EQ(buffer.push(sample(3, 60)), Admission::kInsertedLate);
  EXPECT_EQ(buffer.counters().out_of_order_inserted, 1u);
}

TEST(TspiBuffer, KeepsGoingWhenTheSenderStartsItsNumbersAgain) {
  TspiBuffer buffer{NavConfig{}};
  for (std::uint32_t i = 0; i < 10; ++i) buffer.push(sample(i, i * 20));
  for (std::uint32_t i = 0; i < 10; ++i) EXPECT_EQ(buffer.push(sample(i, 200 + i * 20)), Admission::kAccepted);
  EXPECT_EQ(buffer.counters().seq_restart, 1u);
  EXPECT_EQ(buffer.size(), 20u);
}

TEST(TspiBuffer, CountsNoGapWhereTheSequenceNumberWraps) {
  TspiBuffer buffer{NavConfig{}};
  buffer.push(sample(0xffffffffu, 0));
  buffer.push(sample(0, 20));
  EXPECT_EQ(buffer.counters().seq_gap, 0u);
  EXPECT_EQ(buffer.counters().seq_restart, 0u);
}

TEST(TspiBuffer, ForgetsTheOldestWhenFullAndRefusesWhatIsOlderStill) {
  TspiBuffer buffer{NavConfig{}, 8};
  for (std::uint32_t i = 0; i < 12; ++i) buffer.push(sample(i, i * 20));
  EXPECT_EQ(buffer.size(), 8u);
  EXPECT_EQ(buffer[0].seq, 4u);
  EXPECT_EQ(buffer.push(sample(100, 70)), Admission::kTooOld);
  EXPECT_EQ(buffer.push(sample(101, 90)), Admission::kInsertedLate);
  EXPECT_EQ(buffer.counters().too_old, 1u);
  for (std::size_t i = 1; i < buffer.size(); ++i) EXPECT_LT(buffer[i - 1].t, buffer[i].t);
}

TEST(TspiBuffer, IsNotImpressedByOneWildTimeStamp) {
  TspiBuffer buffer{NavConfig{}};
  for (std::uint32_t i = 0; i < 5; ++i) buffer.push(sample(i, i * 20));
  EXPECT_EQ(buffer.push(sample(5, 3600e3)), Admission::kHeldBack);
  EXPECT_FALSE(buffer.covers(at_ms(90)));
  EXPECT_EQ(buffer.push(sample(6, 120)), Admission::kAccepted);
  EXPECT_EQ(buffer.push(sample(7, 7200e3)), Admission::kHeldBack);
  EXPECT_EQ(buffer.push(sample(7, 7200e3)), Admission::kDuplicate);
  EXPECT_EQ(buffer.newest().t, at_ms(120));
  EXPECT_EQ(buffer.counters().held_back, 2u);
  EXPECT_EQ(buffer.counters().jump_forward, 0u);
}

TEST(TspiBuffer, FollowsAStreamWhoseClockMovesForward) {
  TspiBuffer buffer{NavConfig{}};
  for (std::uint32_t i = 0; i < 5; ++i) buffer.push(sample(i, i * 20));
  for (std::uint32_t i = 5; i < 8; ++i) buffer.push(sample(i, 60e3 + i * 20));
  EXPECT_EQ(buffer.counters().jump_forward, 1u);
  EXPECT_EQ(buffer.size(), 8u);
  EXPECT_EQ(buffer.at(at_ms(60e3 + 110)).kind, Kind::kInterpolated);
  EXPECT_EQ(buffer.at(at_ms(30e3)).kind, Kind::kTooFar);
}

TEST(TspiBuffer, StartsAnewWhenTheClockMovesBack) {
  TspiBuffer buffer{NavConfig{}};
  for (std::uint32_t i = 0; i < 5; ++i) buffer.push(sample(i, 60e3 + i * 20));
  for (std::uint32_t i = 0; i < 3; ++i) buffer.push(sample(i, i * 20));
  EXPECT_EQ(buffer.counters().jump_back, 1u);
  EXPECT_EQ(buffer.size(), 3u);
  EXPECT_EQ(buffer.newest().t, at_ms(40));
}

TEST(TspiBuffer, DoesNotInterpolateAcrossAWideGap) {
  NavConfig c;
  c.max_gap_ms = 100;
  c.max_age_ms = 300;
  TspiBuffer buffer{c};
  buffer.push(sample(0, 0));
  buffer.push(sample(1, 100));
  buffer.push(sample(2, 1100));
  EXPECT_EQ(buffer.at(at_ms(50)).kind, Kind::kInterpolated);
  EXPECT_LE(buffer.at(at_ms(50)).age.ns, 0);
  const auto early = buffer.at(at_ms(200)), late = buffer.at(at_ms(900));
  EXPECT_EQ(early.kind, Kind::kPredicted);
  EXPECT_EQ(early.age, Duration::from_ms(100));
  EXPECT_EQ(late.kind, Kind::kPredicted);
  EXPECT_EQ(late.age, Duration::from_ms(-200));
  EXPECT_EQ(buffer.at(at_ms(600)).kind, Kind::kTooFar);
  // the covariance grows with the distance to the nearest sample
  double last = 0;
  for (double ms : {110.0, 150.0, 250.0, 390.0}) {
    const double now = buffer.at(at_ms(ms)).state.position_cov_e.trace();
    EXPECT_GT(now, last);
    last = now;
  }
}

TEST(TspiBuffer, PredictsOnlyWithinTheAgeAllowed) {
  TspiBuffer buffer{NavConfig{}};
  EXPECT_EQ(buffer.at(at_ms(0)).kind, Kind::kEmpty);
  buffer.push(sample(0, 1000));
  EXPECT_EQ(buffer.at(at_ms(1000)).kind, Kind::kInterpolated);
  EXPECT_EQ(buffer.at(at_ms(1500)).kind, Kind::kPredicted);
  EXPECT_EQ(buffer.at(at_ms(1500) + Duration{1}).kind, Kind::kTooFar);
  EXPECT_EQ(buffer.at(at_ms(1500) + Duration{1}).age, Duration{500000001});
  EXPECT_EQ(buffer.at(at_ms(400)).kind, Kind::kTooFar);
}

TEST(TspiBuffer, UsesNoHeapAfterConstruction) {
  const std::vector<Tspi> samples = stream(1000, 20);
  TspiBuffer buffer{NavConfig{}};
  test::HeapGuard guard;
  for (std::size_t i = 0; i + 1 < samples.size(); i += 2) {
    buffer.push(samples[i + 1]);
    buffer.push(samples[i]);
    (void)buffer.at(samples[i].t + Duration::from_ms(3));
  }
  EXPECT_EQ(guard.count(), 0u);
}

}  // namespace
}  // namespace cyclops
