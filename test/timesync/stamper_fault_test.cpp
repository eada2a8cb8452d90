// What happens on each fault; the table of docs/time.md, row by row.
#include <gtest/gtest.h>

#include "test/timesync/stamper_fixture.hpp"

namespace cyclops {
namespace {

using test::StampInput;
class StamperFault : public test::FrameStamperTest {};

TEST_F(StamperFault, ALostEdgeIsReplacedByTheCameraClockAndShiftsNothing) {
  for (const bool with_seq : {true, false}) {
    setup.with_seq = with_seq;
    make();
    lose_edges(40, 42);
    go();
    expect_strobe(0, 40);
    for (std::size_t i = 40; i < 42; ++i) {
      EXPECT_EQ(source(i), TimeSource::kCameraTick);
      EXPECT_LE(std::llabs(error_ns(i)), 3 * out[i].info.t_mid_sigma.ns);
    }
    expect_strobe(42, 100);
    EXPECT_EQ(stamper->counters().no_edge_lost, 2U);
    EXPECT_EQ(with_seq ? stamper->counters().edges_lost_seq : stamper->counters().edges_lost_inferred, 2U);
    EXPECT_EQ(stamper->counters().lock_count, 1U);
  }
}

TEST_F(StamperFault, LostFramesShiftNothing) {
  make();
  run.frames.erase(run.frames.begin() + 31, run.frames.begin() + 61);
  for (std::size_t i = 1; i < run.frames.size(); ++i) run.frames[i].token = i - 1;
  run.truth.erase(run.truth.begin() + 30, run.truth.begin() + 60);
  go();
  expect_strobe(0, 70);
  EXPECT_EQ(stamper->counters().edges_without_frame, 30U);
  EXPECT_EQ(stamper->counters().lock_count, 1U);
}

TEST_F(StamperFault, ADoubledAndASpuriousEdgeAreCountedAndIgnored) {
  make();
  const auto extra = [&](int exposure, std::int64_t after_ns) {
    StampInput e = run.edges[static_cast<std::size_t>(exposure) + 1];
    e.edge.t = e.ready = e.ready + Duration{after_ns};
    run.edges.insert(run.edges.begin() + exposure + 2, e);
  };
  extra(60, 15'000'000);
  extra(30, 200'000);
  go();
  expect_strobe(0, 100);
  EXPECT_EQ(stamper->counters().edges_doubled, 1U);
  EXPECT_EQ(stamper->counters().edges_spurious, 1U);
}

TEST_F(StamperFault, ALostFirstEdgeIsSeenInTheArrivals) {
  setup.faults.first_edges_lost = 2;
  make();
  go();
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(source(i), TimeSource::kArrival);
  expect_strobe(2, 100);
  EXPECT_EQ(stamper->counters().first_edges_lost, 1U);
}

TEST_F(StamperFault, AGlitchBeforeTheFirstExposureIsIgnored) {
  make();
  StampInput glitch = run.edges[1];
  glitch.edge.t = glitch.ready = glitch.ready - Duration{12'000'000};
  run.edges.insert(run.edges.begin() + 1, glitch);
  go();
  expect_strobe(0, 100);
}

TEST_F(StamperFault, ArrivalsLaterThanConfiguredNeverShiftTheNumber) {
  // GIVEN frames that always arrive a period and more after their exposure, so that the next edge would fit them
  // WHEN the start was announced
  // THEN the first edge contradicts, and no time is said to come from the strobe until a restart
  setup.transport = Duration{40'000'000};
  make();
  go();
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(source(i), TimeSource::kArrival);
  EXPECT_EQ(stamper->counters().start_refused, 1U);
  EXPECT_GE(out[50].info.t_mid_sigma.ns, setup.period.ns);
}

TEST_F(StamperFault, WhenTheTransportMayTakeAPeriodTheGapAtTheStartPicksTheNumberAndNothingElse) {
  for (const bool announced : {true, false}) {
    setup.announce_start = announced;
    FrameStamperConfig config = test::stamper_config(setup);
    config.transport_max = Duration{60'000'000};
    setup.faults.first_frame = announced ? 0 : 5;
    make();
    go(config);
    if (announced) expect_strobe(0, 100);
    for (std::size_t i = 0; !announced && i < out.size(); ++i) EXPECT_EQ(source(i), TimeSource::kArrival);
    EXPECT_EQ(stamper->counters().ambiguous > 0, !announced);
  }
}

TEST_F(StamperFault, AnIdSkippedByTheCameraIsFoundAtOnceAndLockedAnew) {
  make();
  for (std::size_t i = 51; i < run.frames.size(); ++i) ++run.frames[i].frame.camera_frame_id;
  go();
  expect_strobe(0, 100);
  EXPECT_EQ(losses(LockLoss::kTickStep), 1U);
}

TEST_F(StamperFault, AnIdLeftOutByTheCameraIsFoundAtOnceAndLockedAnew) {
  make();
  for (std::size_t i = 51; i < run.frames.size(); ++i) --run.frames[i].frame.camera_frame_id;
  go();
  for (std::size_t i = 0; i < out.size(); ++i)
    if (source(i) == TimeSource::kStrobe) { EXPECT_LE(std::llabs(error_ns(i)), 21'000) << "frame " << i; }
  EXPECT_EQ(losses(LockLoss::kNumberBack) + losses(LockLoss::kTickStep), 1U);
  expect_strobe(55, 100);
}

TEST_F(StamperFault, AStepOfTheCameraClockIsFoundAtOnceAndLockedAnew) {
  make();
  for (std::size_t i = 51; i < run.frames.size(); ++i) run.frames[i].frame.camera_tick_ns += setup.period.ns;
  go();
  expect_strobe(0, 100);
  EXPECT_EQ(losses(LockLoss::kTickStep), 1U);
  EXPECT_EQ(stamper->counters().lock_count, 2U);
}

TEST_F(StamperFault, APauseThatOnlyTheClockShowsIsFoundAtOnceAndLockedAnew) {
  // GIVEN a camera that rests for five and a half periods and then counts on as if nothing had been
  make();
  const Duration rest{setup.period.ns * 11 / 2};
  for (auto* list : {&run.edges, &run.frames}) {
    for (std::size_t i = 51; i < list->size(); ++i) {
      StampInput& in = (*list)[i];
      in.ready = in.ready + rest;
      in.edge.t = in.edge.t + rest;
      in.frame.t_arrival = in.frame.t_arrival + rest;
      in.frame.camera_tick_ns += rest.ns;
    }
  }
  for (std::size_t i = 50; i < run.truth.size(); ++i) run.truth[i] = run.truth[i] + rest;
  go();
  expect_strobe(0, 100);
  EXPECT_EQ(losses(LockLoss::kTickStep), 1U);
}

TEST_F(StamperFault, AStalledHostDoesNotDisturbTheLock) {
  make();
  const Time end = run.frames[60].ready;
  for (std::size_t i = 31; i < 60; ++i) run.frames[i].ready = run.frames[i].frame.t_arrival = end;
  go();
  expect_strobe(0, 100);
  EXPECT_EQ(stamper->counters().lock_count, 1U);
}

TEST_F(StamperFault, FramesEvenlyLateByAPeriodDropTheLockUntilTheyComeInTimeAgain) {
  make();
  delay_arrivals(40, 70, setup.period);
  go();
  expect_strobe(0, 40);
  for (std::size_t i = 40; i < 70; ++i) EXPECT_EQ(source(i), TimeSource::kArrival) << i;
  EXPECT_GE(out[50].info.t_mid_sigma.ns, setup.period.ns - 10'000);
  EXPECT_EQ(losses(LockLoss::kLateArrival), 1U);
  EXPECT_GT(stamper->counters().doubtful, 0U);
  expect_strobe(71, 100);
}

TEST_F(StamperFault, AnIdLeftOutWhileTheCameraClockJumpsBackByAPeriodIsNeverBelieved) {
  // GIVEN exposure 50 with an edge and without a frame, and ids and clock that go on as if it had not been
  make();
  for (std::size_t i = 52; i < run.frames.size(); ++i) {
    --run.frames[i].frame.camera_frame_id;
    run.frames[i].frame.camera_tick_ns -= setup.period.ns;
  }
  run.frames.erase(run.frames.begin() + 51);
  run.truth.erase(run.truth.begin() + 50);
  for (std::size_t i = 1; i < run.frames.size(); ++i) run.frames[i].token = i - 1;
  // WHEN edges, numbers and ticks agree on the exposure before
  go();
  // THEN the arrivals, late by a period, keep the strobe's name off every wrong time
  expect_strobe(0, 50);
  for (std::size_t i = 50; i < out.size(); ++i) {
    EXPECT_EQ(source(i), TimeSource::kArrival) << i;
    EXPECT_LE(std::llabs(error_ns(i)), out[i].info.t_mid_sigma.ns) << i;
  }
  EXPECT_EQ(losses(LockLoss::kLateArrival), 1U);
}

TEST_F(StamperFault, LateFramesWaitForOneInTimeAndThenKeepTheirEdges) {
  make();
  delay_arrivals(40, 42, setup.period + setup.period / 8);
  delay_arrivals(60, 63, setup.period);   // evenly late, but not four of them
  go();
  expect_strobe(0, 100);
  EXPECT_EQ(stamper->counters().lock_count, 1U);
}

TEST_F(StamperFault, LateFramesWithNoneAfterThemSayHowFarTheyMayBeOff) {
  make();
  delay_arrivals(98, 100, setup.period + setup.period / 8);
  go();
  expect_strobe(0, 98);
  for (std::size_t i = 98; i < 100; ++i) {
    EXPECT_EQ(source(i), TimeSource::kArrival);
    EXPECT_LE(std::llabs(error_ns(i)), out[i].info.t_mid_sigma.ns + 500'000);
  }
  EXPECT_EQ(stamper->counters().unproven, 2U);
}

TEST_F(StamperFault, AFrameBeforeTheEndOfItsExposureDropsTheLock) {
  make();
  delay_arrivals(50, 51, Duration{-8'000'000});
  go();
  EXPECT_EQ(losses(LockLoss::kEarlyArrival), 1U);
}

TEST_F(StamperFault, WithoutEdgesTheCameraClockServesThenTheArrival) {
  // GIVEN 100 frames with edges and then 400 without, at 30 Hz, and ten seconds of holdover allowed
  setup.exposures = 500;
  make();
  lose_edges(100, 500);
  FrameStamperConfig config = test::stamper_config(setup);
  config.tick_holdover = Duration::from_seconds(10);
  go(config);
  EXPECT_EQ(source(150), TimeSource::kCameraTick);
  EXPECT_LE(std::llabs(error_ns(390)), 3 * out[390].info.t_mid_sigma.ns);
  EXPECT_GT(out[390].info.t_mid_sigma, out[150].info.t_mid_sigma);
  EXPECT_EQ(source(450), TimeSource::kArrival) << "more than 10 s";
  EXPECT_EQ(losses(LockLoss::kHoldover), 1U);
  EXPECT_EQ(stamper->counters().starved, 1U);
}

TEST_F(StamperFault, EdgesThatComeBackAreUsedAgain) {
  make();
  lose_edges(30, 60);
  go();
  expect_strobe(0, 30);
  expect_strobe(61, 100);
  EXPECT_EQ(stamper->counters().lock_count, 1U);
}

TEST_F(StamperFault, AFrameWithoutLeaderKeepsItsPlaceAndGetsItsArrival) {
  make();
  FrameInfo& f = run.frames[51].frame;
  f.camera_frame_id = 0;
  f.camera_tick_ns = 0;
  f.status = FrameStatus::kMissing;
  go();
  EXPECT_EQ(source(50), TimeSource::kArrival);
  EXPECT_LE(std::llabs(error_ns(50)), out[50].info.t_mid_sigma.ns);
  expect_strobe(0, 50);
  expect_strobe(51, 100);
  EXPECT_EQ(stamper->counters().unnumbered, 1U);
}

TEST_F(StamperFault, AnIncompleteFrameWithTheIdOfAnEarlierOneIsNotBelieved) {
  make();
  run.frames[51].frame.camera_frame_id = 10;
  run.frames[51].frame.camera_tick_ns = run.frames[10].frame.camera_tick_ns;
  run.frames[51].frame.status = FrameStatus::kMissing;
  go();
  EXPECT_EQ(source(50), TimeSource::kArrival);
  expect_strobe(51, 100);
}

TEST_F(StamperFault, EdgesThatMoveAgainstTheCameraClockAreFollowedAfterFive) {
  make();
  for (std::size_t i = 51; i < run.edges.size(); ++i) run.edges[i].edge.t = run.edges[i].ready = run.edges[i].ready + Duration{3'000'000};
  for (std::size_t i = 50; i < 100; ++i) run.truth[i] = run.truth[i] + Duration{3'000'000};
  go();
  for (std::size_t i = 50; i < 54; ++i) {
    EXPECT_EQ(source(i), TimeSource::kCameraTick);
    EXPECT_GE(out[i].info.t_mid_sigma.ns, 2'900'000);
  }
  expect_strobe(54, 100);
  EXPECT_EQ(losses(LockLoss::kResidual), 1U);
}

TEST_F(StamperFault, OtherSlopesAndDisorderedEdgesAreCountedAndDropped) {
  make();
  StampInput e = run.edges[20];
  e.edge.rising = false;
  run.edges.insert(run.edges.begin() + 21, e);
  run.edges.insert(run.edges.begin() + 30, run.edges[25]);
  run.edges[30].ready = run.edges[29].ready;
  go();
  expect_strobe(0, 100);
  EXPECT_EQ(stamper->counters().edges_other, 1U);
  EXPECT_EQ(stamper->counters().edges_disordered, 1U);
}

TEST_F(StamperFault, AnEdgeStampedLateIsNotUsed) {
  make();
  run.edges[51].edge.t = run.edges[51].edge.t + Duration{2'500'000};
  go();
  EXPECT_EQ(source(50), TimeSource::kCameraTick);
  EXPECT_LE(std::llabs(error_ns(50)), 100'000);
  EXPECT_GE(out[50].info.t_mid_sigma.ns, 2'400'000) << "which of the two was wrong is not known";
  expect_strobe(51, 100);
  EXPECT_EQ(stamper->counters().no_edge_beside, 1U);
}

}  // namespace
}  // namespace cyclops
