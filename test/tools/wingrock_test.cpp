#include <gtest/gtest.h>

#include <cmath>

#include "test/support.hpp"
#include "tools/image_roll.hpp"
#include "tools/wingrock.hpp"

namespace cyclops::tools {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDeg = kPi / 180;

/// Two rolls of 15 deg and 4 s, and what the air does to the wings in between; smooth, at TSPI's time.
struct Rocks {
  std::vector<double> begin_s{20, 100};
  double gust_deg{0.2};
  double operator()(double t) const {
    double roll = gust_deg * (std::sin(2.1 * t) + std::sin(1.3 * t + 1)) * kDeg;
    for (const double b : begin_s)
      if (t > b && t < b + 4) roll += 15 * kDeg * std::sin(2 * kPi * (t - b) / 4) * (t - b < 1 || b + 4 - t < 1 ? 0.5 - 0.5 * std::cos(kPi * std::min(t - b, b + 4 - t)) : 1);
    return roll;
  }
};

/// Frames at 30 Hz whose stamps are off: t_tspi = t_frame + offset + drift (t_frame - middle).
struct Flight {
  RollSeries seen;
  RollAt tspi;
};
Flight fly(const Rocks& rocks, double length_s, double offset_s, double drift, std::uint64_t seed, double gain = 1) {
  test::Random random(seed);
  std::normal_distribution<double> white;
  Flight f;
  double slow = 0;  // what features and attitude errors do together over seconds
  const double mid = 0.5 * length_s;
  for (double t = 0; t < length_s; t += 1.0 / 30) {
    slow += -slow / (30 * 2.0) + 0.03 * kDeg * std::sqrt(2 / (30 * 2.0)) * white(random);
    f.seen.t_s.push_back(t);
    f.seen.roll_rad.push_back(gain * rocks(t + offset_s + drift * (t - mid)) + 0.7 * kDeg + 0.3 * kDeg * std::sin(0.05 * t) + slow + 0.05 * kDeg * white(random));
  }
  f.tspi = [rocks](std::size_t, double t) { return t < -10 || t > 1000 ? std::nan("") : rocks(t); };
  return f;
}

TEST(WingRock, FindsOffsetAndDriftThatWereInjected) {
  for (const auto& [offset, drift] : {std::pair{0.0, 0.0}, {0.137, 300e-6}, {-2.31, -150e-6}}) {
    const Flight f = fly({}, 124, offset, drift, 1);
    const WingRockResult r = wing_rock(f.seen, f.tspi);
    ASSERT_TRUE(r.enough) << r.reason;
    EXPECT_TRUE(r.has_drift);
    EXPECT_EQ(r.manoeuvres.size(), 2U);
    EXPECT_NEAR(r.offset_s, offset, 4 * r.offset_sigma_s);
    EXPECT_NEAR(r.drift, drift, 4 * r.drift_sigma);
    EXPECT_LT(r.offset_sigma_s, 0.002);
    EXPECT_LT(r.drift_sigma, 50e-6);
    EXPECT_NEAR(r.gain, 1, 0.01);
  }
}

TEST(WingRock, ItsSigmaIsHonest) {
  int offset_within = 0, drift_within = 0;
  double squares = 0;
  constexpr int kRuns = 60;
  for (int run = 0; run < kRuns; ++run) {
    const Flight f = fly({}, 124, 0.05, 100e-6, 100 + static_cast<std::uint64_t>(run));
    const WingRockResult r = wing_rock(f.seen, f.tspi);
    ASSERT_TRUE(r.enough) << r.reason;
    offset_within += std::fabs(r.offset_s - 0.05) < 2 * r.offset_sigma_s ? 1 : 0;
    drift_within += std::fabs(r.drift - 100e-6) < 2 * r.drift_sigma ? 1 : 0;
    squares += std::pow((r.offset_s - 0.05) / r.offset_sigma_s, 2);
  }
  EXPECT_GE(offset_within, kRuns * 88 / 100) << "of " << kRuns;   // 95 % expected, 2.5 sigma of the count below that
  EXPECT_GE(drift_within, kRuns * 88 / 100) << "of " << kRuns;
  EXPECT_GT(std::sqrt(squares / kRuns), 0.5);                     // nor is it a vast one
}

TEST(WingRock, AFlightWithoutRollGivesNoAnswerAndSaysWhy) {
  Rocks calm;
  calm.begin_s.clear();
  const Flight f = fly(calm, 60, 0.05, 0, 3);
  const WingRockResult r = wing_rock(f.seen, f.tspi);
  EXPECT_FALSE(r.enough);
  EXPECT_NE(r.reason.find("not enough roll motion"), std::string::npos) << r.reason;
}

TEST(WingRock, ARollWithoutBeginningAndEndIsAmbiguous) {
  const Flight f = fly({}, 30, 0, 0, 4);
  const RollAt forever = [](std::size_t, double t) { return 10 * kDeg * std::sin(2 * kPi * t / 4); };
  RollSeries seen = f.seen;
  for (std::size_t i = 0; i < seen.t_s.size(); ++i) seen.roll_rad[i] = forever(0, seen.t_s[i]);
  const WingRockResult r = wing_rock(seen, forever);
  EXPECT_FALSE(r.enough);
  EXPECT_NE(r.reason.find("ambiguous"), std::string::npos) << r.reason;
}

TEST(WingRock, OneManoeuvreGivesAnOffsetButNoDrift) {
  Rocks one;
  one.begin_s = {10};
  const Flight f = fly(one, 24, -0.08, 0, 5);
  const WingRockResult r = wing_rock(f.seen, f.tspi);
  ASSERT_TRUE(r.enough) << r.reason;
  EXPECT_FALSE(r.has_drift);
  EXPECT_NEAR(r.offset_s, -0.08, 4 * r.offset_sigma_s);
}

TEST(WingRock, TooFewFramesAndTspiElsewhereAreSaid) {
  EXPECT_NE(wing_rock({}, {}).reason.find("fewer than 30 frames"), std::string::npos);
  Flight f = fly({}, 30, 0, 0, 6);
  const RollAt nowhere = [](std::size_t, double) { return std::nan(""); };
  EXPECT_NE(wing_rock(f.seen, nowhere).reason.find("does not cover"), std::string::npos);
}

TEST(ImageRoll, ReadsTheTurnOfShapesWhateverTheirSizePlaceAndMissingPoints) {
  test::Random random(7);
  std::normal_distribution<double> white;
  Shape model;
  for (int i = 0; i < 20; ++i) model.push_back({i, {white(random), white(random)}});
  std::vector<Shape> frames;
  std::vector<double> turns;
  for (int k = 0; k < 40; ++k) {
    const double turn = 15 * kDeg * std::sin(0.3 * k), size = 0.05 + 0.001 * k;
    turns.push_back(turn);
    Shape s;
    for (const ShapePoint& p : model)
      if ((p.feature + k) % 4 != 0)
        s.push_back({p.feature, Vec2(0.1 + size * (std::cos(turn) * p.xy.x() - std::sin(turn) * p.xy.y()), -0.2 + size * (std::sin(turn) * p.xy.x() + std::cos(turn) * p.xy.y()))});
    frames.push_back(s);
  }
  const auto reference = RollReference::from(frames);
  ASSERT_TRUE(reference.ok());
  const double first = reference->roll(frames[0])->roll_rad;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const auto r = reference->roll(frames[k]);
    ASSERT_TRUE(r.has_value());
    EXPECT_NEAR(r->roll_rad - first, turns[k] - turns[0], 1e-6);
    EXPECT_LT(r->sigma_rad, 1e-6);
  }
  EXPECT_FALSE(reference->roll(Shape(model.begin(), model.begin() + 4)).has_value());
  EXPECT_FALSE(RollReference::from(std::vector<Shape>{}).ok());
}

}  // namespace
}  // namespace cyclops::tools
