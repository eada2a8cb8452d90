#include "timesync/frame_stamper.hpp"

#include <gtest/gtest.h>

#include "test/timesync/stamper_fixture.hpp"

namespace cyclops {
namespace {

using test::FrameStamperTest;
using test::Stamped;
using test::StampInput;

TEST_F(FrameStamperTest, StampsEveryFrameOfAQuietRunWithItsOwnEdge) {
  setup.edge_jitter = {};
  make();
  go();
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(error_ns(i), 0);
  expect_strobe(0, out.size());
  EXPECT_EQ(stamper->counters().matched, 100U);
  EXPECT_EQ(stamper->counters().lock_count, 1U);
  EXPECT_LE(out[50].info.t_mid_sigma.ns, 50'000);
}

TEST_F(FrameStamperTest, TheTimeIsEdgeLessDelayPlusHalfTheExposureOfThatFrame) {
  setup.edge_jitter = {};
  make();
  for (std::size_t i = 50; i < 100; ++i) run.frames[i + 1].frame.exposure = Duration{2'000'000};
  FrameStamperConfig config = test::stamper_config(setup);
  config.edge_delay = Duration{300'000};
  go(config);
  EXPECT_EQ(error_ns(10), -300'000);
  EXPECT_EQ(error_ns(60), -300'000 - 1'000'000);
}

TEST_F(FrameStamperTest, EitherEdgeOrFrameMayComeFirst) {
  make();
  go();
  const auto expected = out;
  for (const auto& [edges, frames] : {std::pair{Duration{100'000'000}, Duration{}}, std::pair{Duration{}, Duration{500'000'000}}}) {
    FrameStamper other(test::stamper_config(setup));
    const auto got = test::feed(other, test::interleave(run, edges, frames, random));
    ASSERT_EQ(got.size(), expected.size());
    for (std::size_t i = 0; i < got.size(); ++i) EXPECT_EQ(got[i].info.t_mid, expected[i].info.t_mid);
  }
}

TEST_F(FrameStamperTest, StartsInTheMiddleByArrivalAlone) {
  setup.announce_start = false;
  setup.faults.first_frame = 30;
  make();
  go();
  expect_strobe(0, 70);
}

TEST_F(FrameStamperTest, ACameraThatStartsAfreshUnannouncedIsLockedAnew) {
  setup.faults.camera_restart_at = 90;
  setup.exposures = 200;
  make();
  go();
  EXPECT_EQ(losses(LockLoss::kNumberBack), 1U);
  expect_strobe(0, 200);
}

TEST_F(FrameStamperTest, AnAnnouncedRestartLocksFromItsFirstFrame) {
  setup.faults.announced_restart_at = 90;
  setup.exposures = 200;
  make();
  go();
  EXPECT_EQ(losses(LockLoss::kRestart), 1U);
  expect_strobe(0, 200);
}

TEST_F(FrameStamperTest, BlockIdsOfSixteenBitsWrap) {
  setup.id_bits = 16;
  setup.first_id = 65'500;
  make();
  FrameStamperConfig config = test::stamper_config(setup);
  go(config);
  expect_strobe(0, 100);
  EXPECT_EQ(out[36].info.camera_frame_id, 1U);
  EXPECT_EQ(stamper->counters().lock_count, 1U);
}

TEST_F(FrameStamperTest, ACameraWhoseIdsGoOnAcrossStartsIsLocked) {
  setup.first_id = 5'000'000'000;
  make();
  FrameStamperConfig config = test::stamper_config(setup);
  config.first_frame_id = 0;
  go(config);
  expect_strobe(0, 100);
}

TEST_F(FrameStamperTest, WithoutAStrobeFramesDoNotWaitAfterTheFirstEight) {
  make();
  FrameStamper live(test::stamper_config(setup));
  Stamped s;
  for (std::size_t i = 1; i <= 30; ++i) {
    ASSERT_TRUE(live.on_frame(run.frames[i].frame, run.frames[i].token));
    int n = 0;
    for (; live.pop(s.info, s.token); ++n) EXPECT_EQ(s.info.time_source, TimeSource::kArrival);
    EXPECT_EQ(n, i < 8 ? 0 : i == 8 ? 8 : 1) << "frame " << i;
  }
}

TEST_F(FrameStamperTest, AFrameLeavesAsSoonAsItsEdgeIsThere) {
  make();
  FrameStamper live(test::stamper_config(setup));
  const auto inputs = test::interleave(run, {}, {}, random);
  Stamped s;
  std::size_t frames = 0, popped = 0;
  for (const StampInput& in : inputs) {
    if (in.kind == StampInput::Kind::kRestart) live.restart(in.edge.t);
    if (in.kind == StampInput::Kind::kEdge) live.on_edge(in.edge);
    if (in.kind == StampInput::Kind::kFrame) { ++frames; ASSERT_TRUE(live.on_frame(in.frame, in.token)); }
    while (live.pop(s.info, s.token)) ++popped;
    if (frames > 5) { EXPECT_EQ(popped, frames) << "only the lock itself waits"; }
  }
}

TEST_F(FrameStamperTest, ACameraWithoutTickGetsTheArrival) {
  make();
  for (StampInput& in : run.frames) in.frame.camera_tick_ns = 0;
  go();
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(source(i), TimeSource::kArrival);
}

TEST_F(FrameStamperTest, WithoutEdgeTickAndArrivalTheTimeIsUnknown) {
  FrameStamper s({});
  FrameInfo f;
  f.camera_frame_id = 1;
  ASSERT_TRUE(s.on_frame(f, 7));
  s.flush();
  Stamped got;
  ASSERT_TRUE(s.pop(got.info, got.token));
  EXPECT_EQ(got.info.time_source, TimeSource::kUnknown);
  EXPECT_EQ(got.token, 7U);
}

TEST_F(FrameStamperTest, MovingARunByAConstantMovesItsTimesAndChangesNoOtherBit) {
  setup.faults.lost_edge = setup.faults.spurious_edge = 0.1;
  make();
  go();
  const auto before = out;
  const Duration far{4'000'000'000'000'000'000};
  for (auto* list : {&run.edges, &run.frames}) {
    for (StampInput& in : *list) {
      in.ready = in.ready + far;
      in.edge.t = in.edge.t + far;
      in.frame.t_arrival = in.frame.t_arrival + far;
      in.frame.camera_tick_ns += 1'000'000'000'000'000'000;
    }
  }
  for (Time& t : run.truth) t = t + far;
  go();
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_EQ((out[i].info.t_mid - before[i].info.t_mid).ns, far.ns);
    EXPECT_EQ(out[i].info.t_mid_sigma, before[i].info.t_mid_sigma);
  }
}

TEST_F(FrameStamperTest, RefusesFramesWhenTheCallerDoesNotPop) {
  make();
  FrameStamper s(test::stamper_config(setup));
  std::size_t taken = 0;
  for (std::size_t i = 1; i < run.frames.size(); ++i) taken += s.on_frame(run.frames[i].frame, 0) ? 1 : 0;
  EXPECT_EQ(taken, 64U);
  EXPECT_EQ(s.counters().refused_frames, 36U);
}

TEST_F(FrameStamperTest, UsesNoHeap) {
  setup.faults.lost_edge = setup.faults.spurious_edge = setup.faults.camera_restart = 0.05;
  make();
  const auto inputs = test::interleave(run, {}, {}, random);
  FrameStamper s(test::stamper_config(setup));
  Stamped got;
  const test::HeapGuard guard;
  for (const StampInput& in : inputs) {
    if (in.kind == StampInput::Kind::kEdge) s.on_edge(in.edge);
    if (in.kind == StampInput::Kind::kFrame) (void)s.on_frame(in.frame, in.token);
    while (s.pop(got.info, got.token)) {}
  }
  EXPECT_EQ(guard.count(), 0U);
}

TEST(FrameStamperConfig, NamesTheBadKeyItsValueAndItsRange) {
  FrameStamperConfig c;
  EXPECT_TRUE(c.validated().ok());
  c.max_wait_frames = 100;
  EXPECT_EQ(c.validated().error().message(), "time.max_wait_frames: is 100.000000, expected 4.000000 to 32.000000");
}

TEST(FrameStamperConfig, ReadsTheRig) {
  auto file = ConfigFile::parse("[time]\ntransport_max_ms = 20\nfirst_frame_id = 0\nblock_ids = \"16 bit\"\nmax_wait_frames = 12\n", "rig.toml").value();
  ConfigTable table = file.root().table("time");
  const FrameStamperConfig c = FrameStamperConfig::read(table).value();
  ASSERT_TRUE(file.finish().ok());
  EXPECT_EQ(c.transport_max.ns, 20'000'000);
  EXPECT_EQ(c.first_frame_id, 0U);
  EXPECT_EQ(c.id_bits, 16);
  EXPECT_EQ(c.max_wait_frames, 12);
}

}  // namespace
}  // namespace cyclops
