#pragma once
/// One simulated run through one stamper: change `setup`, make(), change `run`, go(), look.
#include <gtest/gtest.h>

#include <memory>

#include "test/timesync/exposure_sim.hpp"

namespace cyclops::test {

class FrameStamperTest : public testing::Test {
 protected:
  void make() { run = simulate(setup, random); }
  void go() { go(stamper_config(setup)); }
  void go(const FrameStamperConfig& config) {
    stamper = std::make_unique<FrameStamper>(config);
    out = feed(*stamper, interleave(run, {}, {}, random));
    ASSERT_EQ(out.size(), run.truth.size());
    for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(out[i].token, i);
  }
  [[nodiscard]] TimeSource source(std::size_t i) const { return out[i].info.time_source; }
  [[nodiscard]] std::int64_t error_ns(std::size_t i) const { return (out[i].info.t_mid - run.truth[i]).ns; }
  void expect_strobe(std::size_t from, std::size_t to) const {
    for (std::size_t i = from; i < to; ++i) {
      EXPECT_EQ(source(i), TimeSource::kStrobe) << "frame " << i;
      EXPECT_LE(std::llabs(error_ns(i)), 21'000) << "frame " << i;
    }
  }
  [[nodiscard]] std::uint64_t losses(LockLoss cause) const { return stamper->counters().lock_loss[static_cast<std::size_t>(cause)]; }
  // Edges stand in run.edges after the restart: exposure i is edge i + 1.
  void lose_edges(int from, int to) { run.edges.erase(run.edges.begin() + from + 1, run.edges.begin() + to + 1); }
  // From frame `from` on, everything arrives later by `late`.
  void delay_arrivals(std::size_t from, std::size_t to, Duration late) {
    for (std::size_t i = from; i < to; ++i) {
      StampInput& in = run.frames[i + 1];
      in.ready = in.ready + late;
      in.frame.t_arrival = in.frame.t_arrival + late;
    }
  }

  ExposureSetup setup;
  Random random{1};
  ExposureRun run;
  std::unique_ptr<FrameStamper> stamper;
  std::vector<Stamped> out;
};

}  // namespace cyclops::test
