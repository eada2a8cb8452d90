// HEALTH from counters that the test sets in place of the threads; time is stepped.
#include "service/health.hpp"

#include <gtest/gtest.h>

#include "service/link.hpp"

namespace cyclops {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kLook = 20 * kMs;

class Health : public testing::Test {
 protected:
  Health() {
    s_.started_ns = now_;
    s_.camera_there = true;
    s_.chain_counts.has_tspi[0] = s_.chain_counts.has_tspi[1] = true;
    s_.facts.time_source = TimeSource::kStrobe;
  }
  /// So long with frames at 30 Hz and TSPI at 50 Hz, as far as they are not stopped; true when an alarm came or went.
  bool run(std::int64_t ms) {
    bool changed = false;
    for (const std::int64_t end = now_ + ms * kMs; now_ < end; now_ += kLook) {
      if (frames_ && now_ >= next_frame_) {
        next_frame_ = (next_frame_ == 0 ? now_ : next_frame_) + 33'333'333;
        ++s_.camera_counts.received;
        ++s_.chain_counts.frames;
        ++s_.chain_counts.consensus;
        s_.last_frame_host_ns = s_.last_published_ns = now_;
      }
      for (int a = 0; a < 2; ++a)
        if (tspi_[a]) {
          ++s_.chain_counts.tspi[a].accepted;
          s_.chain_counts.tspi_arrival[a] = Time{now_};
        }
      changed = maker_.look(now_) || changed;
    }
    return changed;
  }
  /// Codes of the events of the alarms since the last call.
  std::vector<std::string> events() {
    std::vector<std::string> out;
    while (auto e = s_.events.next())
      if (std::string(e->source.data()) == "alarm") out.emplace_back(e->level == EventLevel::kRecovery ? "-" : "+").append(e->code.data());
    return out;
  }
  static ServiceOptions options() {
    ServiceOptions o;
    std::erase_if(o.limits.items, [](const Limit& l) { return l.name.starts_with("host.") || l.name == "memory.grows"; });  // of the machine that runs the test
    return o;
  }

  std::int64_t now_{1'000'000 * kMs};
  std::int64_t next_frame_{0};
  bool frames_{true}, tspi_[2]{true, true};
  Rig rig_{};
  Pipeline::State s_{rig_, Profile(), options()};
  HealthMaker maker_{s_};
};

TEST_F(Health, SaysRatesOfTheLastSecondAndThatAllIsWell) {
  EXPECT_FALSE(run(3000));
  const health_t& h = maker_.message();
  EXPECT_EQ(h.state, health_t::RUNNING);
  EXPECT_NEAR(h.frame_rate_hz, 30, 1);
  EXPECT_NEAR(h.frame_rate_share, 1, 0.05);
  EXPECT_NEAR(h.tspi_tanker_rate_hz, 50, 1);
  EXPECT_LE(h.tspi_tanker_silence_ms, 20);
  EXPECT_EQ(h.frames_lost_1s, 0);
  EXPECT_FLOAT_EQ(h.consensus_share, 1);
  EXPECT_EQ(h.n_alarms, 0);
  EXPECT_TRUE(events().empty());
  EXPECT_EQ(h.number, 1);
  EXPECT_EQ(maker_.message().number, 2);
}

TEST_F(Health, ASilenceIsAnEventAndInTheNextHealthWithin200Milliseconds) {
  run(2000);
  events();
  tspi_[1] = false;
  EXPECT_TRUE(run(200));
  EXPECT_EQ(events(), std::vector<std::string>{"+tspi.tanker.silent"});
  const health_t& h = maker_.message();
  ASSERT_EQ(h.n_alarms, 1);
  EXPECT_EQ(h.alarms[0].name, "tspi.tanker.silent");
  EXPECT_EQ(h.alarms[0].level, alarm_t::FAULT);
  tspi_[1] = true;
  EXPECT_TRUE(run(1000));
  EXPECT_EQ(events(), std::vector<std::string>{"-tspi.tanker.silent"});
}

TEST_F(Health, TellsHowOldTheMarksOfGpsTimeAreAndRaisesTheAlarmWhenTheyStop) {
  run(2000);
  EXPECT_FLOAT_EQ(maker_.message().gps_sigma_us, -1);
  EXPECT_FLOAT_EQ(maker_.message().gps_age_s, -1);
  EXPECT_FLOAT_EQ(maker_.message().strobe_age_s, -1);
  ClockState& c = s_.chain_counts.clocks;
  c.gps_source = GpsSource::kArrival;
  c.gps_sigma = Duration::from_ms(0.5);
  run(20);
  EXPECT_FLOAT_EQ(maker_.message().gps_sigma_us, -1) << "no frame yet whose time it could be";
  c.t = Time{1};
  run(20);
  EXPECT_FLOAT_EQ(maker_.message().gps_sigma_us, 500);
  EXPECT_FLOAT_EQ(maker_.message().gps_age_s, -1) << "no mark";
  c.gps_source = GpsSource::kTimeMark;
  c.gps_age = Duration::from_seconds(1);
  c.camera_sigma = Duration{1000};
  c.camera_age = Duration::from_ms(30);
  EXPECT_FALSE(run(200));
  EXPECT_FLOAT_EQ(maker_.message().gps_age_s, 1);
  EXPECT_FLOAT_EQ(maker_.message().strobe_age_s, 0.03F);
  c.gps_age = Duration::from_seconds(6);
  EXPECT_TRUE(run(40));
  EXPECT_EQ(events(), std::vector<std::string>{"+gps.holdover"});
}

TEST_F(Health, ALostFrameIsAnAlarmAtOnceAndForASecondAfterwards) {
  run(2000);
  ++s_.camera_counts.lost_gap;
  EXPECT_TRUE(run(20));
  EXPECT_EQ(maker_.message().frames_lost_1s, 1);
  EXPECT_EQ(events(), std::vector<std::string>{"+frames.lost"});
  run(1500);
  EXPECT_EQ(maker_.message().frames_lost_1s, 0);
  run(1000);
  EXPECT_EQ(events(), std::vector<std::string>{"-frames.lost"});
  EXPECT_EQ(maker_.message().frames_lost, 1);
}

TEST_F(Health, EveryRefusedMessageOfAnyCauseCountsAsRefused) {
  run(2000);
  s_.link_counts[static_cast<std::size_t>(Link::kTanker)] = {9, 1, 2, 3, 4, 5};
  run(20);
  const health_t& h = maker_.message();
  EXPECT_EQ(h.refused_1s, 1 + 2 + 3 + 4 + 5);
  EXPECT_EQ(events(), std::vector<std::string>{"+link.refused"});
  const auto value = [&](const std::string& name) {
    for (const counter_t& c : h.counters)
      if (c.name == name) return c.value;
    return std::int64_t{-1};
  };
  EXPECT_EQ(value("tspi.tanker.received"), 9);
  EXPECT_EQ(value("tspi.tanker.flooded"), 2);
  EXPECT_EQ(value("tspi.tanker.not_authentic"), 3);
  EXPECT_EQ(value("tspi.tanker.replayed"), 4);
  EXPECT_EQ(value("tspi.receiver.refused"), 0);
}

TEST_F(Health, WithoutACameraItSaysSoFromTheStart) {
  frames_ = false;
  s_.camera_there = false;
  EXPECT_TRUE(run(400));
  const health_t& h = maker_.message();
  EXPECT_EQ(h.state, health_t::STARTING);
  EXPECT_EQ(h.alarm_line.rfind("camera is silent", 0), 0U) << h.alarm_line;
  EXPECT_GE(h.frame_age_ms, 380);
  EXPECT_FLOAT_EQ(h.frame_rate_share, -1);
  EXPECT_EQ(h.time_source, -1);
}

TEST_F(Health, FramesThatStillWaitForTheirTimeAreNoAlarm) {
  // GIVEN a camera that has begun, and no frame out of the chain: the lock needs four
  s_.facts.time_source = TimeSource::kUnknown;
  s_.camera_counts.received = 5;
  frames_ = false;
  s_.last_frame_host_ns = s_.last_published_ns = now_ + 200 * kMs;
  EXPECT_FALSE(run(200));
}

TEST_F(Health, FramesThatComeWhileNothingGoesOutAreAnAlarm) {
  run(2000);
  events();
  for (int i = 0; i < 60; ++i) {
    frames_ = false;
    s_.last_frame_host_ns = now_;
    ++s_.camera_counts.received;
    run(20);
  }
  const auto said = events();
  EXPECT_NE(std::find(said.begin(), said.end(), "+measurements.silent"), said.end());
  EXPECT_EQ(std::find(said.begin(), said.end(), "+camera.silent"), said.end());
}

TEST(HostWatch, KnowsThisProcess) {
  HostWatch watch;
  const HostFacts& facts = watch.look(1);
  EXPECT_GT(facts.memory_mb, 1);
  EXPECT_GE(facts.open_files, 3);
  EXPECT_GE(facts.load, 0);
}

}  // namespace
}  // namespace cyclops
