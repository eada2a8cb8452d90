#include "nav/relative.hpp"

#include <gtest/gtest.h>

#include <type_traits>

#include "test/nav/flying.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

using test::at_ms;
using test::kDeg;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat12 = Eigen::Matrix<double, 12, 12>;
using Vec12 = Eigen::Matrix<double, 12, 1>;

template <class A, class B>
concept Subtractable = requires(A a, B b) { a - b; };
template <class A, class B>
concept Addable = requires(A a, B b) { a + b; };
using RotR = Rotation<frame::N, frame::R>;
using RotK = Rotation<frame::N, frame::K>;

// Spec E5 and 3.5: attitudes cannot be differenced, and a direction of flight cannot stand in for an attitude.
static_assert(!Subtractable<RotR, RotK> && !Subtractable<RotR, RotR> && !Addable<RotR, RotR>);
static_assert(!Subtractable<Eigen::Quaterniond, Eigen::Quaterniond>);
static_assert(!Subtractable<Pose<frame::E, frame::R>, Pose<frame::E, frame::K>>);
static_assert(!std::is_constructible_v<RotR, FlightPath> && !std::is_constructible_v<RotR, HeadingPitchBank>);
static_assert(!std::is_constructible_v<HeadingPitchBank, FlightPath> && !Subtractable<FlightPath, FlightPath>);
static_assert(!std::is_constructible_v<Eigen::Quaterniond, HeadingPitchBank>);
static_assert(!std::is_convertible_v<Rotation<frame::R, frame::K>, Rotation<frame::K, frame::R>>);
static_assert(!Subtractable<Point<frame::R>, Point<frame::K>>);

NavRig arms() { return {{1.5, -0.4, 0.7}, {-2.0, 0.3, 1.1}}; }

AircraftState state(const Tspi& s) { return predict(s, s.t, NavConfig{}); }

struct Pair {
  AircraftState receiver, tanker;
};

/// Both aircraft in the geometry of spec 1.7, in a banked turn.
Pair formation() {
  test::Flyer r;
  r.q_n_b = attitude<frame::R>({40 * kDeg, 4 * kDeg, 15 * kDeg}).quaternion();
  r.turn_rps = 0.02;
  test::Flyer k = r;
  const auto T = test::spec_1_7();
  k.q_n_b = r.q_n_b * T.rotation().quaternion();
  k.offset_n = r.q_n_b * T.translation().xyz;
  return {state(r.at(Aircraft::kReceiver, 1, Time{})), state(k.at(Aircraft::kTanker, 1, Time{}))};
}

/// Errors in the order: receiver attitude, receiver position, tanker attitude, tanker position.
Pair disturbed(Pair p, const Vec12& e) {
  p.receiver.q_e_b = p.receiver.q_e_b * so3_exp(e.segment<3>(0));
  p.receiver.position.xyz += e.segment<3>(3);
  p.tanker.q_e_b = p.tanker.q_e_b * so3_exp(e.segment<3>(6));
  p.tanker.position.xyz += e.segment<3>(9);
  return p;
}

Vec6 error_of(const RelativeState& truth, const RelativeState& estimate) {
  Vec6 e;
  e.head<3>() = so3_log(truth.T_r_k.rotation().quaternion() * estimate.T_r_k.rotation().quaternion().conjugate());
  e.tail<3>() = truth.T_r_k.translation() - estimate.T_r_k.translation();
  return e;
}

RelativeState solve(const Pair& p, double correlation = 0) { return relative_state(p.receiver, p.tanker, arms(), correlation, {}); }

Mat12 input_covariance(const Pair& p) {
  Mat12 P = Mat12::Zero();
  P.block<3, 3>(0, 0) = p.receiver.attitude_cov_b;
  P.block<3, 3>(3, 3) = p.receiver.position_cov_e;
  P.block<3, 3>(6, 6) = p.tanker.attitude_cov_b;
  P.block<3, 3>(9, 9) = p.tanker.position_cov_e;
  return P;
}

TEST(RelativeState, CovarianceEqualsTheOneFromNumericalDerivatives) {
  const Pair p = formation();
  const RelativeState nominal = solve(p);
  Eigen::Matrix<double, 6, 12> J;
  for (int i = 0; i < 12; ++i) {
    const double h = i % 6 < 3 ? 1e-5 : 1e-3;
    const Vec12 step = h * Vec12::Unit(i);
    J.col(i) = (error_of(solve(disturbed(p, step)), nominal) - error_of(solve(disturbed(p, -step)), nominal)) / (2 * h);
  }
  const Mat6 want = J * input_covariance(p) * J.transpose();
  const Vec6 per_sigma = want.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((per_sigma.asDiagonal() * (nominal.covariance - want) * per_sigma.asDiagonal()).norm(), 1e-5);
}

TEST(RelativeState, CovarianceAgreesWithMonteCarlo) {
  const Pair p = formation();
  const RelativeState nominal = solve(p);
  const Mat12 L = input_covariance(p).llt().matrixL();
  test::Random random(5);
  std::normal_distribution<double> g;
  const int draws = 40000;
  double nees = 0;
  Mat6 seen = Mat6::Zero();
  for (int n = 0; n < draws; ++n) {
    Vec12 z;
    for (int i = 0; i < 12; ++i) z[i] = g(random);
    const Vec6 e = error_of(solve(disturbed(p, L * z)), nominal);
    seen += e * e.transpose() / draws;
    nees += e.dot(nominal.covariance.ldlt().solve(e)) / draws;
  }
  EXPECT_NEAR(nees, 6, 0.1);
  // compared element by element in units of the sigmas
  const Vec6 sigma = nominal.covariance.diagonal().cwiseSqrt();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) EXPECT_NEAR((seen(i, j) - nominal.covariance(i, j)) / (sigma[i] * sigma[j]), 0, 0.03) << i << j;
}

TEST(RelativeState, CommonPositionErrorsCancelAsFarAsTheyAreCorrelated) {
  Pair p = formation();
  p.receiver.attitude_cov_b.setZero();
  p.tanker.attitude_cov_b.setZero();
  const double independent = solve(p, 0).covariance.trace();
  EXPECT_NEAR(solve(p, 0.75).covariance.trace(), 0.25 * independent, 1e-6);
  EXPECT_NEAR(solve(p, 1).covariance.trace(), 0, 1e-6);
}

TEST(RelativeState, ATimingErrorAddsWhatMovesInIt) {
  const Pair p = formation();
  const RelativeState sharp = solve(p);
  const RelativeState blurred = relative_state(p.receiver, p.tanker, arms(), 0, Duration::from_ms(20));
  Vec6 rate;
  rate.head<3>() = sharp.rate_r;
  rate.tail<3>() = sharp.velocity_r;
  EXPECT_LT((blurred.covariance - sharp.covariance - 4e-4 * rate * rate.transpose()).norm(), 1e-12);
}

TEST(RelativeState, VelocityAndRateAreTheTimeDerivativesOfThePose) {
  // GIVEN two aircraft that turn and roll differently, with lever arms
  test::Flyer r;
  r.q_n_b = attitude<frame::R>({0.4, 0.1, 0.3}).quaternion();
  r.turn_rps = 0.05;
  test::Flyer k;
  k.offset_n = {30, 10, -8};
  k.velocity_n = {140, 85, 1};
  k.spin_b = {0.2, -0.1, 0.05};
  const auto pose = [&](double ms) {
    return relative_state(state(r.at(Aircraft::kReceiver, 0, at_ms(ms))), state(k.at(Aircraft::kTanker, 0, at_ms(ms))), arms(), 0, {});
  };
  // WHEN the pose is differenced over 2 ms, THEN it changes by the reported velocity and rate
  const RelativeState before = pose(999), now = pose(1000), after = pose(1001);
  const Vec3 velocity = (after.T_r_k.translation() - before.T_r_k.translation()) / 2e-3;
  const Vec3 rate = so3_log(after.T_r_k.rotation().quaternion() * before.T_r_k.rotation().quaternion().conjugate()) / 2e-3;
  EXPECT_LT((now.velocity_r - velocity).norm(), 1e-4);
  EXPECT_LT((now.rate_r - rate).norm(), 1e-6);
}

}  // namespace
}  // namespace cyclops
