// Do the aircraft fly? Derivatives, coordination, and the figures that the scenario asks for.
#include "hil/motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/earth.hpp"
#include "hil/way.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kStep_s = 1e-3, kTurnStep_s = 2e-4;

Scenario busy() {
  Scenario s = Scenario::load("config/scenarios/turn.toml").value();
  s.wing_rocks.push_back({false, 3, 12, 3, 2});
  s.wing_rocks.push_back({true, 8, 15, 4, 1});
  s.legs.push_back({"right", 3, 2, 3, 1, 1, false, 0, 0, 0});
  return s;
}

Vec3 level_rate(const AircraftState& before, const AircraftState& after) {
  const Mat3 a = local_from_ecef(before.position_e).R_e_n.transpose() * before.R_e_b, b = local_from_ecef(after.position_e).R_e_n.transpose() * after.R_e_b;
  return so3_log(Eigen::Quaterniond(Mat3(a.transpose() * b))) / (2 * kTurnStep_s);
}

HeadingPitchBank level_attitude(const AircraftState& s) { return heading_pitch_bank(local_from_ecef(s.position_e).R_e_n.transpose() * s.R_e_b); }

TEST(Motion, VelocityAndRatesAreTheDerivativesOfPositionAndAttitude) {
  // GIVEN turns, wing rocks and gusts over five seeds
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Motion motion(busy(), seed);
    for (double t = 0; t < 15; t += 0.237)
      for (const bool tanker : {false, true}) {
        const auto at = [&](double x) { return tanker ? motion.tanker(x) : motion.receiver(x); };
        // WHEN position is differentiated by five points, error of order step^4
        const Vec3 v = (8 * (at(t + kStep_s).position_e - at(t - kStep_s).position_e) - (at(t + 2 * kStep_s).position_e - at(t - 2 * kStep_s).position_e)) / (12 * kStep_s);
        // THEN it agrees to what ECEF coordinates in doubles allow: 1e-9 m over 1e-3 s
        EXPECT_LT((v - at(t).velocity_e).norm(), 5e-6) << "seed " << seed << " t " << t;
        EXPECT_LT((level_rate(at(t - kTurnStep_s), at(t + kTurnStep_s)) - at(t).rate_b_rps).norm(), 5e-6) << "seed " << seed << " t " << t;
      }
  }
}

TEST(Motion, NothingJumps) {
  const Motion motion(busy(), 3);
  AircraftState last = motion.receiver(0);
  for (double t = 0.01; t < 15; t += 0.01) {
    const AircraftState now = motion.receiver(t);
    EXPECT_LT((now.position_e - last.position_e - 0.005 * (now.velocity_e + last.velocity_e)).norm(), 2e-4) << t;
    EXPECT_LT((now.rate_b_rps - last.rate_b_rps).norm(), 0.1) << t;
    last = now;
  }
}

TEST(Motion, ATurnIsCoordinatedAndAsFastAsItsBankAsks) {
  // GIVEN calm air and 15 deg of bank
  Scenario s = Scenario::load("config/scenarios/turn.toml").value();
  s.receiver_gusts = s.tanker_gusts = {{0, 0.1, 0.5}, {0, 0.1, 0.5}, {0, 0.1, 0.5}, {0, 0.1, 0.5}, {0, 0.1, 0.5}, {0, 0.1, 0.5}};
  s.wind_north_mps = s.wind_east_mps = 0;
  const Motion motion(s, 1);
  const double t = kFirstFrame_s + 7.5;
  for (const AircraftState& a : {motion.tanker(t), motion.receiver(t)}) {
    const HeadingPitchBank at = level_attitude(a);
    EXPECT_NEAR(at.bank / kDeg, 15, 0.4);
    EXPECT_NEAR(motion.air_angles(a).beta / kDeg, 0, 0.05);
  }
  // THEN heading turns by g tan(bank) / V, and the angle of attack carries 1 / cos(bank)
  EXPECT_NEAR(level_rate(motion.tanker(t - kTurnStep_s), motion.tanker(t + kTurnStep_s)).norm(), 9.80665 * std::tan(15 * kDeg) / 110, 2e-4);
  EXPECT_NEAR(motion.air_angles(motion.receiver(t)).alpha / motion.air_angles(motion.receiver(-1)).alpha, 1 / std::cos(15 * kDeg), 0.01);
}

TEST(Motion, CrossWindMakesTheDriftOfTheThesisAndAngleOfAttackIsTheScenarios) {
  const Scenario s = Scenario::load("config/scenarios/s4.toml").value();
  const Motion motion(s, 1);
  double drift = 0, alpha = 0;
  int n = 0;
  for (double t = 0; t < 7; t += 0.1, ++n) {
    const AircraftState r = motion.receiver(t);
    const Vec3 v = local_from_ecef(r.position_e).R_e_n.transpose() * r.velocity_e;
    drift += std::fabs(std::remainder(std::atan2(v.y(), v.x()) - level_attitude(r).heading, 2 * std::numbers::pi)) / kDeg;
    alpha += motion.air_angles(r).alpha / kDeg;
  }
  EXPECT_NEAR(drift / n, 6.5, 0.4);  // spec 3.5
  EXPECT_NEAR(alpha / n, 5, 0.3);
}

TEST(Motion, ReceiverKeepsTheHeightAboveTheEllipsoidAndTheRateOfClosureThatAreAsked) {
  Scenario s = Scenario::load("config/scenarios/s1.toml").value();
  const Motion motion(s, 2);
  const auto range_ft = [&](double t) {
    const AircraftState r = motion.receiver(t), k = motion.tanker(t);
    const Vec3 d = (s.reference_in - s.ins_in) * 0.0254;
    return ((r.position_e + r.R_e_b * (s.lens_in_receiver_m + s.nose_from_lens_m)) - (k.position_e + k.R_e_b * Vec3(-d.x(), d.y(), -d.z()))).norm() / 0.3048;
  };
  EXPECT_NEAR(range_ft(kFirstFrame_s), 100, 1.5);
  EXPECT_NEAR(range_ft(kFirstFrame_s + 1400 / 30.0), 35, 1.5);  // spec E17
  for (double t : {0.0, 20.0, 46.0}) EXPECT_NEAR(local_from_ecef(motion.tanker(t).position_e).height_m, 6000, 1);
  // 46 s at 110 m/s through a wind from the side
  EXPECT_NEAR((motion.tanker(46).position_e - motion.tanker(0).position_e).norm(), 46 * std::hypot(110, 12.47), 6);
}

TEST(Motion, WingRockReachesItsBankOnBothSides) {
  const Scenario s = Scenario::load("config/scenarios/wing-rock.toml").value();
  const Motion motion(s, 1);
  double most = 0, least = 0;
  for (double t = 0; t < 5; t += 0.02) {
    const double bank = level_attitude(motion.receiver(t)).bank / kDeg;
    most = std::max(most, bank), least = std::min(least, bank);
  }
  EXPECT_NEAR(most, 15, 2.5);  // spec 3.4; gusts on top
  EXPECT_NEAR(least, -15, 2.5);
}

TEST(Motion, FewerFramesAreTheBeginningOfTheSameFlight) {
  Scenario s = Scenario::load("config/scenarios/s2.toml").value();
  const Motion whole(s, 1);
  s.frames = 60;
  const Motion part(s, 1);
  for (double t = 0; t < 2.4; t += 0.1) EXPECT_EQ((whole.receiver(t).position_e - part.receiver(t).position_e).norm(), 0) << t;
}

TEST(Wander, HasTheVarianceItIsAskedFor) {
  double sum = 0, square = 0;
  int n = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Wander w({0.3, 0.5, 0.7}, seed);
    for (double t = 0; t < 60; t += 0.37, ++n) sum += w.at(t), square += w.at(t) * w.at(t);
  }
  EXPECT_NEAR(sum / n, 0, 0.01);
  EXPECT_NEAR(std::sqrt(square / n), 0.3, 0.01);
}

}  // namespace
}  // namespace cyclops::hil
