#include "nav/motion.hpp"

#include <gtest/gtest.h>

#include <GeographicLib/Geocentric.hpp>
#include <vector>

#include "test/nav/flying.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

using test::angle_between;
using test::at_ms;
using test::Flyer;
using test::kDeg;

constexpr double kEcefRounding = 5e-9;  // m; half a unit in the last place of an ECEF coordinate is 5e-10

Flyer turning() {
  Flyer f;
  f.velocity_n = {160, 120, -3};
  f.q_n_b = attitude<frame::K>({0.6, 0.05, 0.5}).quaternion();
  f.turn_rps = 3 * kDeg;
  return f;
}

Flyer rolling() {
  Flyer f;
  f.q_n_b = attitude<frame::K>({-2.0, 0.1, -0.2}).quaternion();
  f.spin_b = {0.3, -0.05, 0.02};
  return f;
}

TEST(StateFromReport, TurnsAGeodeticReportIntoEcef) {
  // GIVEN a report over Edwards, heading east, level, 200 m/s
  TspiReport r;
  r.latitude_deg = 34.9;
  r.longitude_deg = -117.9;
  r.height_m = 7000;
  r.velocity_ned_mps = {0, 200, 0};
  r.q_n_b = attitude<frame::K>({90 * kDeg, 0, 0}).quaternion();
  // WHEN it becomes a state, THEN it agrees with GeographicLib's own rotation (columns east, north, up)
  const Tspi s = state_from_report(r, at_ms(12));
  std::vector<double> M(9);
  Vec3 p;
  GeographicLib::Geocentric::WGS84().Forward(r.latitude_deg, r.longitude_deg, r.height_m, p.x(), p.y(), p.z(), M);
  const Vec3 east(M[0], M[3], M[6]), up(M[2], M[5], M[8]);
  EXPECT_LT((s.position.xyz - p).norm(), 1e-9);
  EXPECT_LT((s.velocity_e - 200 * east).norm(), 1e-12 * 200);
  EXPECT_LT((s.q_e_b * Vec3::UnitX() - east).norm(), 1e-14);
  EXPECT_LT((s.q_e_b * Vec3::UnitZ() + up).norm(), 1e-14);
  EXPECT_EQ(s.t, at_ms(12));
}

TEST(StateFromReport, AddsTheTurnOfTheLevelAxesToTheBodyRates) {
  // An aircraft that keeps level while it flies north over the curved earth pitches down by v / (M + h) relative to the earth.
  TspiReport r;
  r.latitude_deg = 45;
  r.velocity_ned_mps = {200, 0, 0};
  const Tspi s = state_from_report(r, Time{});
  EXPECT_NEAR(s.rate_b.y(), -200 / 6367381.8, 1e-11);
  EXPECT_NEAR(s.rate_b.x(), 0, 1e-15);
}

TEST(Interpolate, IsExactForConstantVelocityAndConstantBodyRate) {
  const Flyer f = rolling();
  const Tspi a = f.at(Aircraft::kTanker, 1, at_ms(1000)), b = f.at(Aircraft::kTanker, 2, at_ms(1100));
  for (double ms : {1000.0, 1000.001, 1033.0, 1050.0, 1099.0, 1100.0}) {
    const Tspi want = f.at(Aircraft::kTanker, 0, at_ms(ms));
    const AircraftState got = interpolate(a, b, at_ms(ms), {});
    EXPECT_LT((got.position - want.position).norm(), kEcefRounding);
    EXPECT_LT(angle_between(got.q_e_b, want.q_e_b), 1e-14);
    EXPECT_LT((got.velocity_e - want.velocity_e).norm(), 1e-12);
    EXPECT_LT((got.rate_b - want.rate_b).norm(), 1e-14);
  }
}

TEST(Interpolate, StaysWithinTheHermiteBoundInAConstantTurn) {
  const Flyer f = turning();
  for (double h_ms : {20.0, 50.0, 100.0, 200.0, 500.0}) {
    const Tspi a = f.at(Aircraft::kTanker, 1, at_ms(0)), b = f.at(Aircraft::kTanker, 2, at_ms(h_ms));
    const double bound = 200 * std::pow(f.turn_rps, 3) * std::pow(h_ms * 1e-3, 4) / 384 + kEcefRounding;
    for (double s = 0.05; s < 1; s += 0.05) {
      const Tspi want = f.at(Aircraft::kTanker, 0, at_ms(s * h_ms));
      const AircraftState got = interpolate(a, b, at_ms(s * h_ms), {});
      EXPECT_LT((got.position - want.position).norm(), bound) << h_ms << " ms";
      EXPECT_LT(angle_between(got.q_e_b, want.q_e_b), 1e-14);
    }
  }
}

TEST(Interpolate, MovesWithARigidMotionOfBothSamples) {
  // The SE(3) property: G * interpolate(a, b) = interpolate(G a, G b).
  test::Random random(7);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 100; ++n) {
    const Flyer f = n % 2 == 0 ? turning() : rolling();
    Tspi a = f.at(Aircraft::kTanker, 1, at_ms(0)), b = f.at(Aircraft::kTanker, 2, at_ms(100));
    const AircraftState before = interpolate(a, b, at_ms(37), {});
    const Eigen::Quaterniond G = so3_exp(3 * Vec3(u(random), u(random), u(random)));
    for (Tspi* s : {&a, &b}) {
      s->position = Point<frame::E>(G * s->position.xyz);
      s->velocity_e = G * s->velocity_e;
      s->q_e_b = G * s->q_e_b;
    }
    const AircraftState after = interpolate(a, b, at_ms(37), {});
    EXPECT_LT((after.position.xyz - G * before.position.xyz).norm(), 2 * kEcefRounding);
    EXPECT_LT(angle_between(after.q_e_b, G * before.q_e_b), 1e-14);
  }
}

TEST(Interpolate, TakesTheShortWayWhicheverSignTheQuaternionHas) {
  const Flyer f = rolling();
  Tspi a = f.at(Aircraft::kTanker, 1, at_ms(0)), b = f.at(Aircraft::kTanker, 2, at_ms(100));
  const AircraftState one = interpolate(a, b, at_ms(40), {});
  b.q_e_b.coeffs() *= -1;
  EXPECT_LT(angle_between(one.q_e_b, interpolate(a, b, at_ms(40), {}).q_e_b), 1e-14);
}

TEST(Interpolate, AttitudeComposesAlongTheGeodesic) {
  // Half of the first half is a quarter of the whole.
  const Flyer f = rolling();
  const Tspi a = f.at(Aircraft::kTanker, 1, at_ms(0)), b = f.at(Aircraft::kTanker, 3, at_ms(400));
  Tspi half = a;
  half.t = at_ms(200);
  half.q_e_b = interpolate(a, b, half.t, {}).q_e_b;
  EXPECT_LT(angle_between(interpolate(a, half, at_ms(100), {}).q_e_b, interpolate(a, b, at_ms(100), {}).q_e_b), 1e-14);
}

TEST(Predict, IsExactForConstantVelocityForwardAndBackward) {
  const Flyer f = rolling();
  const Tspi a = f.at(Aircraft::kTanker, 1, at_ms(1000));
  for (double ms : {600.0, 1000.0, 1450.0}) {
    const Tspi want = f.at(Aircraft::kTanker, 0, at_ms(ms));
    const AircraftState got = predict(a, at_ms(ms), {});
    EXPECT_LT((got.position - want.position).norm(), kEcefRounding);
    EXPECT_LT(angle_between(got.q_e_b, want.q_e_b), 1e-14);
  }
}

TEST(Predict, CovarianceFollowsTheStatedGrowth) {
  Flyer f = rolling();
  f.spin_b.setZero();
  const Tspi a = f.at(Aircraft::kTanker, 1, at_ms(0));
  const NavConfig c;
  const Mat3 R = level_axes(f.datum.latitude_deg, f.datum.longitude_deg).matrix();
  double last = 0;
  for (double T : {0.0, 0.05, 0.1, 0.2, 0.5}) {
    const AircraftState s = predict(a, at_ms(1e3 * T), c);
    const Mat3 ned = R.transpose() * s.position_cov_e * R;
    for (int i = 0; i < 3; ++i) {
      const double sp = a.position_sigma_ned_m[i], sv = a.velocity_sigma_ned_mps[i], sa = a.attitude_sigma_rad[i];
      EXPECT_NEAR(ned(i, i), sp * sp + std::pow(sv * T, 2) + std::pow(0.5 * c.acceleration_sigma_mps2 * T * T, 2), 1e-5);
      EXPECT_NEAR(s.attitude_cov_b(i, i), sa * sa + std::pow(c.rate_sigma_rps * T, 2) + std::pow(0.5 * c.angular_acceleration_sigma_rps2 * T * T, 2), 1e-12);
    }
    EXPECT_GT(s.position_cov_e.trace(), last);
    last = s.position_cov_e.trace();
  }
}

TEST(Predict, ErrorsOfAnAcceleratingAircraftHaveThePredictedSpread) {
  // GIVEN aircraft with an unknown constant acceleration of the configured sigma, and exact samples
  NavConfig c;
  c.acceleration_sigma_mps2 = 2;
  test::Random random(11);
  std::normal_distribution<double> g;
  Flyer f;
  Tspi a = f.at(Aircraft::kTanker, 1, at_ms(0));
  a.position_sigma_ned_m.setZero();
  a.velocity_sigma_ned_mps.setZero();
  const AircraftState s = predict(a, at_ms(400), c);
  double nees = 0;
  const int draws = 4000;
  for (int n = 0; n < draws; ++n) {
    const Vec3 error = 0.5 * 0.4 * 0.4 * c.acceleration_sigma_mps2 * Vec3(g(random), g(random), g(random));
    nees += error.dot(s.position_cov_e.ldlt().solve(error)) / draws;
  }
  EXPECT_NEAR(nees, 3, 0.15);
}

TEST(Interpolate, CovarianceIsTheSamplesOwnAtTheEndsAndGrowsBetweenThem) {
  const Flyer f = turning();
  NavConfig c;
  c.acceleration_sigma_mps2 = 20;
  c.angular_acceleration_sigma_rps2 = 2;
  const Tspi a = f.at(Aircraft::kTanker, 1, at_ms(0)), b = f.at(Aircraft::kTanker, 2, at_ms(200));
  const AircraftState end = interpolate(a, b, a.t, c), mid = interpolate(a, b, at_ms(100), c);
  EXPECT_NEAR(end.position_cov_e.trace(), a.position_sigma_ned_m.squaredNorm(), 1e-12);
  EXPECT_NEAR(end.attitude_cov_b.trace(), a.attitude_sigma_rad.squaredNorm(), 1e-15);
  EXPECT_GT(mid.position_cov_e.trace(), end.position_cov_e.trace());
  EXPECT_GT(mid.attitude_cov_b.trace(), 2 * end.attitude_cov_b.trace());
}

}  // namespace
}  // namespace cyclops
