#include "nav/frame_aligner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "test/nav/flying.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

using test::at_ms;

FrameInfo frame(std::uint64_t id, double ms) {
  FrameInfo f;
  f.seq = f.camera_frame_id = id;
  f.t_mid = at_ms(ms);
  f.time_source = TimeSource::kStrobe;
  f.status = FrameStatus::kComplete;
  return f;
}

Tspi tspi(Aircraft aircraft, std::uint32_t seq, double ms) {
  test::Flyer f;
  f.turn_rps = 0.03;
  if (aircraft == Aircraft::kTanker) f.offset_n = {30, 5, -8};
  return f.at(aircraft, seq, at_ms(ms));
}

void push_both(FrameAligner& aligner, std::uint32_t seq, double ms) {
  aligner.push(tspi(Aircraft::kReceiver, seq, ms));
  aligner.push(tspi(Aircraft::kTanker, seq, ms));
}

std::vector<AlignedFrame> taken(FrameAligner& aligner) {
  std::vector<AlignedFrame> out;
  for (AlignedFrame f; aligner.pop(f);) out.push_back(f);
  return out;
}

NavConfig every(int n) {
  NavConfig c;
  c.update_every_n_frames = n;
  return c;
}

TEST(FrameAligner, HoldsAFrameUntilBothAircraftCoverIt) {
  FrameAligner aligner(NavConfig{}, NavRig{});
  push_both(aligner, 0, 0);
  aligner.push(frame(1, 10), 77);
  EXPECT_TRUE(taken(aligner).empty());
  aligner.push(tspi(Aircraft::kReceiver, 1, 20));
  EXPECT_TRUE(taken(aligner).empty());
  aligner.push(tspi(Aircraft::kTanker, 1, 20));
  const auto out = taken(aligner);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].token, 77u);
  EXPECT_TRUE(out[0].nav.state.valid);
  EXPECT_FALSE(out[0].nav.state.extrapolated);
  EXPECT_EQ(aligner.counters().covered, 1u);
}

TEST(FrameAligner, LetsAFrameGoWhenOneLaterByTheWaitHasCome) {
  FrameAligner aligner(NavConfig{}, NavRig{});
  push_both(aligner, 0, 0);
  aligner.push(frame(1, 10), 1);
  aligner.push(frame(2, 43), 2);
  aligner.push(frame(3, 109.999), 3);
  EXPECT_TRUE(taken(aligner).empty());
  aligner.push(frame(4, 110), 4);
  const auto out = taken(aligner);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_TRUE(out[0].nav.state.valid && out[0].nav.state.extrapolated);
  EXPECT_EQ(out[0].nav.state.age_receiver, Duration::from_ms(10));
  EXPECT_EQ(aligner.counters().timed_out, 1u);
}

TEST(FrameAligner, GoesOnWithoutNavigationAndSaysWhy) {
  FrameAligner aligner(NavConfig{}, NavRig{});
  aligner.push(tspi(Aircraft::kReceiver, 0, 0));
  aligner.push(frame(1, 10), 1);
  aligner.flush();
  const auto out = taken(aligner);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_FALSE(out[0].nav.state.valid);
  EXPECT_TRUE(out[0].scheduled);
  EXPECT_EQ(out[0].nav.absence, NavAbsence::kNoTanker);
  EXPECT_EQ(out[0].nav.state.t, at_ms(10));
  EXPECT_EQ(aligner.counters().flushed, 1u);
  EXPECT_EQ(aligner.counters().without_nav, 1u);
}

TEST(FrameAligner, DoesNotHoldFramesThatNeedNoNavigation) {
  FrameAligner aligner(every(3), NavRig{});
  push_both(aligner, 0, 0);
  push_both(aligner, 1, 20);
  for (std::uint64_t id = 1; id <= 4; ++id) aligner.push(frame(id, 10.0 + 33.0 * static_cast<double>(id - 1)), id);
  // frame 1 is covered, 2 and 3 are no updates, 4 waits
  const auto out = taken(aligner);
  ASSERT_EQ(out.size(), 3u);
  EXPECT_EQ(out[0].nav.absence, NavAbsence::kNone);
  EXPECT_EQ(out[1].nav.absence, NavAbsence::kNotScheduled);
  EXPECT_EQ(out[2].nav.absence, NavAbsence::kNotScheduled);
  EXPECT_EQ(aligner.waiting(), 1u);
}

TEST(FrameAligner, KeepsTheOrderOfFramesBehindOneThatWaits) {
  FrameAligner aligner(every(2), NavRig{});
  aligner.push(frame(1, 10), 1);
  aligner.push(frame(2, 43), 2);
  EXPECT_TRUE(taken(aligner).empty());
  push_both(aligner, 0, 0);
  push_both(aligner, 1, 20);
  const auto out = taken(aligner);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[0].token, 1u);
  EXPECT_EQ(out[1].token, 2u);
}

TEST(FrameAligner, PassesAFrameWithoutTimeWithItsOwnReason) {
  FrameAligner aligner(NavConfig{}, NavRig{});
  FrameInfo f = frame(1, 10);
  f.time_source = TimeSource::kUnknown;
  aligner.push(f, 9);
  const auto out = taken(aligner);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].nav.absence, NavAbsence::kNoFrameTime);
}

TEST(FrameAligner, LetsTheOldestGoWhenTooManyWait) {
  NavConfig c;
  c.max_waiting_frames = 4;
  c.max_wait_ms = 5000;
  FrameAligner aligner(c, NavRig{});
  std::vector<std::uint64_t> order;
  for (std::uint64_t id = 1; id <= 10; ++id) {
    aligner.push(frame(id, 33.0 * static_cast<double>(id)), id);
    for (const auto& f : taken(aligner)) order.push_back(f.token);
    EXPECT_LE(aligner.waiting(), 4u);
  }
  EXPECT_EQ(order, (std::vector<std::uint64_t>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(aligner.counters().squeezed_out, 6u);
  EXPECT_EQ(aligner.counters().most_waiting, 4u);
}

TEST(FrameAligner, HoldsABurstOfReadyFramesForACallerThatTakesThemLater) {
  FrameAligner aligner(every(1000), NavRig{});
  for (std::uint64_t id = 1; id <= FrameAligner::kReadyRoom; ++id) aligner.push(frame(id, 33.0 * static_cast<double>(id)), id);
  aligner.flush();
  EXPECT_EQ(taken(aligner).size(), FrameAligner::kReadyRoom);
}

struct Input {
  double arrival;
  int kind;  // 0 frame, 1 receiver, 2 tanker
  std::uint32_t n;
};

std::vector<AlignedFrame> run(const std::vector<Input>& inputs) {
  FrameAligner aligner(every(2), NavRig{});
  std::vector<AlignedFrame> out;
  for (const Input& in : inputs) {
    if (in.kind == 0) aligner.push(frame(in.n + 1, 33.3 * in.n), in.n);
    else aligner.push(tspi(in.kind == 1 ? Aircraft::kReceiver : Aircraft::kTanker, in.n, 20.0 * in.n - (in.kind == 2 ? 7 : 0)));
    for (const auto& f : taken(aligner)) out.push_back(f);
  }
  aligner.flush();
  for (const auto& f : taken(aligner)) out.push_back(f);
  return out;
}

/// Three streams, each in its own order, delayed by up to 75 ms: less than the wait.
std::vector<Input> interleaved(test::Random& random) {
  std::uniform_real_distribution<double> delay(0, 75);
  std::vector<Input> inputs;
  const double step[3] = {33.3, 20, 20};
  for (int kind = 0; kind < 3; ++kind) {
    double last = 0;
    for (std::uint32_t n = 0; n < (kind == 0 ? 60u : 105u); ++n) {
      last = std::max(last, step[kind] * n + delay(random));
      inputs.push_back({last, kind, n});
    }
  }
  std::stable_sort(inputs.begin(), inputs.end(), [](const Input& a, const Input& b) { return a.arrival < b.arrival; });
  return inputs;
}

TEST(FrameAligner, GivesTheSameBitsHoweverTheStreamsAreInterleaved) {
  test::Random random(17);
  const auto want = run(interleaved(random));
  ASSERT_EQ(want.size(), 60u);
  for (int trial = 0; trial < 100; ++trial) {
    const auto got = run(interleaved(random));
    ASSERT_EQ(got.size(), want.size());
    for (std::size_t i = 0; i < got.size(); ++i) {
      ASSERT_EQ(got[i].token, i);
      ASSERT_EQ(got[i].nav.absence, want[i].nav.absence);
      ASSERT_EQ(got[i].nav.state.age_tanker, want[i].nav.state.age_tanker);
      ASSERT_EQ(got[i].nav.state.covariance, want[i].nav.state.covariance);
      ASSERT_EQ(got[i].nav.state.T_r_k.translation().xyz, want[i].nav.state.T_r_k.translation().xyz);
      ASSERT_EQ(got[i].nav.state.T_r_k.rotation().quaternion().coeffs(), want[i].nav.state.T_r_k.rotation().quaternion().coeffs());
    }
  }
}

TEST(FrameAligner, UsesNoHeapAfterConstruction) {
  FrameAligner aligner(NavConfig{}, NavRig{});
  AlignedFrame out;
  test::HeapGuard guard;
  for (std::uint32_t n = 0; n < 200; ++n) {
    push_both(aligner, n, 20.0 * n);
    aligner.push(frame(n + 1, 20.0 * n - 5), n);
    while (aligner.pop(out)) {}
  }
  EXPECT_EQ(guard.count(), 0u);
}

std::vector<std::uint64_t> updates(const NavConfig& config, const std::vector<FrameInfo>& frames) {
  NavSchedule schedule(config);
  std::vector<std::uint64_t> out;
  for (const FrameInfo& f : frames)
    if (schedule.due(f)) out.push_back(f.seq);
  return out;
}

std::vector<FrameInfo> at_30_hz(std::uint64_t n) {
  std::vector<FrameInfo> out;
  for (std::uint64_t id = 1; id <= n; ++id) out.push_back(frame(id, 1000 + 1000.0 / 30 * static_cast<double>(id)));
  return out;
}

TEST(NavSchedule, UpdatesEveryNFramesByCameraNumber) {
  EXPECT_EQ(updates(every(30), at_30_hz(100)), (std::vector<std::uint64_t>{1, 31, 61, 91}));
}

TEST(NavSchedule, ALostFrameShiftsNothing) {
  auto frames = at_30_hz(100);
  frames.erase(frames.begin() + 30);  // number 31, the update itself
  frames.erase(frames.begin() + 5);
  EXPECT_EQ(updates(every(30), frames), (std::vector<std::uint64_t>{1, 32, 61, 91}));
  frames[40].camera_frame_id = 0;     // its leader was lost
  EXPECT_EQ(updates(every(30), frames), (std::vector<std::uint64_t>{1, 32, 61, 91}));
}

TEST(NavSchedule, UpdatesByTimeSinceTheFirstFrame) {
  NavConfig c;
  c.update_interval_s = 0.5;
  EXPECT_EQ(updates(c, at_30_hz(50)), (std::vector<std::uint64_t>{1, 16, 31, 46}));
}

TEST(NavSchedule, WithholdsNavigationInADropout) {
  NavConfig c = every(30);
  c.dropouts.push_back({0.5, 2.5});
  EXPECT_EQ(updates(c, at_30_hz(130)), (std::vector<std::uint64_t>{1, 91, 121}));
}

TEST(NavSchedule, BeginsAnewWhenTheCameraDoes) {
  auto frames = at_30_hz(50);
  for (std::size_t i = 40; i < 50; ++i) frames[i].camera_frame_id = i - 39;
  EXPECT_EQ(updates(every(30), frames), (std::vector<std::uint64_t>{1, 31, 41}));
}

}  // namespace
}  // namespace cyclops
