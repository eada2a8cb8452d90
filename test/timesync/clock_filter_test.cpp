#include "timesync/clock_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "test/timesync/oscillator.hpp"

namespace cyclops {
namespace {

constexpr std::int64_t kFar = 1'450'000'000'000'000'000;

struct Fed { ClockFilter filter; test::Oscillator clock; test::Random& random; double noise_ns; };

Time service(double t_s, double gained_ns) { return Time{std::llround(t_s * 1e9 + gained_ns)}; }
std::int64_t other(double t_s) { return kFar + std::llround(t_s * 1e9); }

void feed(Fed& f, int pairs, double every_s) {
  std::normal_distribution<double> noise(0, f.noise_ns);
  for (int i = 0; i < pairs; ++i) {
    const double t = i * every_s;
    f.filter.add(other(t), service(t, f.clock.gained_ns(t) + noise(f.random)));
  }
}

TEST(ClockFilter, PairsWithoutNoiseGiveOffsetAndRateExactly) {
  ClockFilter f({});
  for (std::int64_t i = 0; i < 100; ++i) f.add(kFar + i * 1'000'000'000, Time{i * 1'000'000'000});
  EXPECT_EQ(f.rate(), 0);
  EXPECT_EQ(f.at(kFar + 123'456'789'012).ns, 123'456'789'012);
}

TEST(ClockFilter, SaysTheScatterThatItSees) {
  for (const double noise : {1'000.0, 15'000.0, 80'000.0}) {
    test::Random random(7);
    Fed f{ClockFilter({}), test::Oscillator({}, random), random, noise};
    feed(f, 900, 1.0 / 30);
    EXPECT_NEAR(f.filter.stamp_sigma_ns(), noise, 0.3 * noise);
  }
}

TEST(ClockFilter, TheSigmaOfOffsetAndRateIsHonestAlsoLongAfterTheLastPair) {
  // GIVEN 200 oscillators, each with two minutes of pairs at 30 Hz
  // WHEN the pairs stop
  // THEN between 90 and 99 % of the errors lie within two sigma: at once, after 10 s and after a minute
  for (const double after : {0.0, 10.0, 60.0}) {
    int inside = 0;
    double squares = 0;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      test::Random random(seed);
      Fed f{ClockFilter({}), test::Oscillator({50, 0.1, 0, 600, 10}, random), random, 15'000};
      feed(f, 3600, 1.0 / 30);
      const double t = 3599 * (1.0 / 30) + after;
      const double error = static_cast<double>((f.filter.at(other(t)) - service(t, f.clock.gained_ns(t))).ns);
      const double sigma = static_cast<double>(f.filter.sigma_at(other(t)).ns);
      if (std::abs(error) <= 2 * sigma) ++inside;
      squares += error * error;
    }
    EXPECT_GE(inside, 180) << after << " s";
    EXPECT_LE(inside, 199) << after << " s";
    EXPECT_LE(std::sqrt(squares / 200), after > 0 ? 80'000 : 6'000);
  }
}

TEST(ClockFilter, AnOutlierHardlyMovesItAndAStepIsFollowed) {
  test::Random random(5);
  Fed f{ClockFilter({}), test::Oscillator({20, 0, 0, 600, 0}, random), random, 10'000};
  feed(f, 200, 0.1);
  const double t = 20;
  EXPECT_GT(std::abs(f.filter.surprise(other(t), service(t, f.clock.gained_ns(t) + 400'000))), 20);
  f.filter.add(other(t), service(t, f.clock.gained_ns(t) + 400'000));
  EXPECT_LE(std::llabs((f.filter.at(other(t)) - service(t, f.clock.gained_ns(t))).ns), 15'000);
  f.filter.forget_offset();
  const double rate = f.filter.rate();
  f.filter.add(other(t + 1), service(t + 1, 5'000'000));
  EXPECT_EQ(f.filter.rate(), rate);
  EXPECT_EQ(f.filter.at(other(t + 1)), service(t + 1, 5'000'000));
}

TEST(ClockFilter, MovingBothClocksChangesNoOtherBit) {
  const auto run = [](std::int64_t move) {
    test::Random random(9);
    std::normal_distribution<double> noise(0, 20'000);
    ClockFilter f({});
    for (std::int64_t i = 0; i < 200; ++i) f.add(i * 33'333'333 + move, Time{i * 33'334'000 + std::llround(noise(random)) - move});
    return std::pair{f.at(7'000'000'000 + move).ns + move, f.sigma_at(7'000'000'000 + move).ns};
  };
  EXPECT_EQ(run(0), run(4'000'000'000'000'000'000));
}

}  // namespace
}  // namespace cyclops
