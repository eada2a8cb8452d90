// Random fault patterns against the one promise: a time said to come from the strobe is right.
// CYCLOPS_STAMP_PATTERNS sets how many patterns are run.
#include <gtest/gtest.h>

#include <cstdlib>

#include "test/timesync/exposure_sim.hpp"

namespace cyclops {
namespace {

using test::ExposureSetup;
using test::Random;
using test::Stamped;

int patterns() {
  const char* text = std::getenv("CYCLOPS_STAMP_PATTERNS");
  return text != nullptr ? std::atoi(text) : 20'000;
}

class Draw {
 public:
  explicit Draw(Random& random) : random_(random) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int below(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  double sometimes(double most) { return below(3) == 0 ? between(0, most) : 0; }

 private:
  Random& random_;
};

ExposureSetup random_setup(Random& random) {
  Draw d(random);
  ExposureSetup s;
  s.period = Duration::from_ms(d.between(12, 70));
  s.exposure = Duration::from_seconds(s.period.seconds() * d.between(0.02, 0.4));
  s.transport = Duration::from_seconds(s.period.seconds() * d.between(0.02, 0.6));
  s.transport_jitter = Duration::from_seconds(s.period.seconds() * d.between(0, 0.19));
  s.edge_jitter = Duration{static_cast<std::int64_t>(d.between(0, 60'000))};
  s.rate_ppm = d.between(-80, 80);
  s.with_seq = d.below(2) == 0;
  s.announce_start = d.below(4) != 0;
  s.exposures = 40 + d.below(40);
  s.faults = {d.sometimes(0.1), d.sometimes(0.1), d.sometimes(0.1), d.sometimes(0.05), d.sometimes(0.1), d.sometimes(0.1), d.sometimes(0.02),
              d.sometimes(0.02), d.sometimes(0.02), d.sometimes(0.02), d.sometimes(0.02), d.sometimes(0.02), 1 + d.below(6), d.below(4) == 0 ? 1 + d.below(5) : 0, d.below(4) == 0 ? 1 + d.below(30) : 0};
  if (s.faults.first_frame > 0) s.announce_start = false;
  return s;
}

TEST(FrameStamperProperty, NeverNamesTheStrobeForAWrongTime) {
  std::uint64_t frames = 0, strobe = 0, tick = 0, arrival = 0, wrong = 0, wrong_tick = 0;
  std::int64_t worst = 0, worst_tick = 0;
  for (int n = 0; n < patterns(); ++n) {
    Random random(static_cast<std::uint64_t>(n) + 1);
    const ExposureSetup setup = random_setup(random);
    const test::ExposureRun run = test::simulate(setup, random);
    FrameStamper stamper(test::stamper_config(setup));
    const auto out = test::feed(stamper, test::interleave(run, setup.period * 2, setup.period, random));
    ASSERT_EQ(out.size(), run.truth.size()) << "pattern " << n;
    for (std::size_t i = 0; i < out.size(); ++i) {
      ASSERT_EQ(out[i].token, i) << "pattern " << n;
      ++frames;
      const std::int64_t error = std::llabs((out[i].info.t_mid - run.truth[i]).ns);
      switch (out[i].info.time_source) {
        case TimeSource::kStrobe:
          ++strobe; worst = std::max(worst, error);
          if (error > 3'000'000 && wrong++ < 5) ADD_FAILURE() << "pattern " << n << " frame " << i << " of " << out.size() << ": off by " << error * 1e-6 << " ms of " << setup.period.seconds() * 1e3;
          break;
        case TimeSource::kCameraTick:
          ++tick; worst_tick = std::max(worst_tick, error);
          if (error > 3'000'000 && wrong_tick++ < 5) std::printf("tick: pattern %d frame %zu off by %.3f ms sigma %.3f\n", n, i, error * 1e-6, out[i].info.t_mid_sigma.seconds() * 1e3);
          break;
        default: ++arrival;
      }
    }
  }
  std::printf("%llu frames: strobe %.1f %%, camera clock %.1f %%, arrival %.1f %%; worst strobe %.3f ms, worst camera clock %.3f ms; wrong tick %llu\n", static_cast<unsigned long long>(frames),
              100.0 * strobe / frames, 100.0 * tick / frames, 100.0 * arrival / frames, worst * 1e-6, worst_tick * 1e-6, static_cast<unsigned long long>(wrong_tick));
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
}  // namespace cyclops
