// The Kalman filter of a track and the motion that navigation's rates predict for it.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "test/support.hpp"
#include "test/track/rig.hpp"

namespace cyclops {
namespace {

using test::TrackRig;

const double T = test::kFrame.seconds();

TrackConfig kalman() {
  TrackConfig c;
  c.filter = Filter::kKalman;
  c.first_hit_takes_corner = false;
  c.corner_sigma_px = 0;
  c.delete_at_score = 1000;
  return c;
}

/// The textbook filter of place and velocity as one state of four, with the inverse and nothing else written out.
class Textbook {
 public:
  using Vec4 = Eigen::Vector4d;
  using Mat4 = Eigen::Matrix4d;
  Textbook(const Vec2& place, double sigma_px, double velocity_sigma_px_s, double q) : q_(q) {
    x << place, 0, 0;
    P.setZero();
    P.topLeftCorner<2, 2>().diagonal().setConstant(sigma_px * sigma_px);
    P.bottomRightCorner<2, 2>().diagonal().setConstant(velocity_sigma_px_s * velocity_sigma_px_s);
  }
  void predict() {
    Mat4 F = Mat4::Identity(), Q = Mat4::Zero();
    F.topRightCorner<2, 2>().diagonal().setConstant(T);
    Q.topLeftCorner<2, 2>().diagonal().setConstant(q_ * T * T * T / 3);
    Q.topRightCorner<2, 2>().diagonal().setConstant(q_ * T * T / 2);
    Q.bottomLeftCorner<2, 2>().diagonal().setConstant(q_ * T * T / 2);
    Q.bottomRightCorner<2, 2>().diagonal().setConstant(q_ * T);
    x = F * x;
    P = F * P * F.transpose() + Q;
  }
  void place(const Vec2& z, const Mat2& R) { measure(0, z, R); }
  void velocity(const Vec2& z, const Mat2& R) { measure(2, z, R); }
  Vec4 x;
  Mat4 P;

 private:
  void measure(int first, const Vec2& z, const Mat2& R) {
    Eigen::Matrix<double, 2, 4> H = Eigen::Matrix<double, 2, 4>::Zero();
    H.block<2, 2>(0, first).setIdentity();
    const Eigen::Matrix<double, 4, 2> K = P * H.transpose() * (H * P * H.transpose() + R).inverse();
    x += K * (z - H * x);
    P = (Mat4::Identity() - K * H) * P;
  }
  double q_;
};

void expect_same(const Track& track, const Textbook& want, int frame) {
  EXPECT_LT((track.uv_px - want.x.head<2>()).norm(), 1e-8) << frame;
  EXPECT_LT((track.velocity_px_s - want.x.tail<2>()).norm(), 1e-7) << frame;
  EXPECT_LT((track.cov_px2 - want.P.topLeftCorner<2, 2>()).norm(), 1e-8) << frame;
}

TEST(Kalman, IsTheTextbooksFilterForCornersOfAnyShapeAndMisses) {
  TrackRig rig(kalman());
  test::Random random(51);
  std::normal_distribution<double> noise;
  rig.begin();
  rig.nav({{400, 300}}, 4);
  Textbook want({400, 300}, 4, TrackConfig{}.velocity_sigma_px_s, TrackConfig{}.acceleration_px2_s3);
  for (int n = 0; n < 200; ++n) {
    const Vec2 z(400 + 0.4 * n + noise(random), 300 - 0.2 * n + noise(random));
    Mat2 R;
    R << 0.3, 0.25 * std::sin(n), 0.25 * std::sin(n), 0.4;
    if (n % 7 == 3) {
      rig.miss();
    } else {
      rig.hit(z, R);
      want.place(z, R);
    }
    expect_same(rig.track(), want, n);
    rig.begin();
    want.predict();
    expect_same(rig.track(), want, n);
  }
}

TEST(Kalman, ItsErrorIsWhatItsCovarianceSaysAndLessThanWithFixedGains) {
  constexpr double q = 100, sigma = 0.5;
  std::array<double, 2> squared{};
  double nees = 0;
  int count = 0;
  for (int flight = 0; flight < 60; ++flight) {
    test::Random random(static_cast<unsigned>(60 + flight));
    std::normal_distribution<double> noise;
    TrackConfig fixed = test::thesis(Filter::kAlphaBeta);
    fixed.delete_at_score = 1000;
    TrackConfig best = kalman();
    best.acceleration_px2_s3 = q;
    TrackRig rig(best), other(fixed);
    for (TrackRig* r : {&rig, &other}) { r->begin(); r->nav({{500, 500}}, 1); }
    Vec2 place(500 + noise(random), 500 + noise(random)), velocity(30 * noise(random), 30 * noise(random));
    for (int n = 0; n < 100; ++n) {
      const Vec2 z = place + sigma * Vec2(noise(random), noise(random));
      for (TrackRig* r : {&rig, &other}) { r->hit(z, sigma); r->begin(); }
      for (int axis = 0; axis < 2; ++axis) {  // white acceleration: correlated steps of place and velocity
        const double a = noise(random), b = noise(random), root = std::sqrt(q);
        place[axis] += T * velocity[axis] + root * std::sqrt(T * T * T / 3) * a;
        velocity[axis] += root * (std::sqrt(3 * T) / 2 * a + std::sqrt(T) / 2 * b);
      }
      if (rig.track().state != TrackState::kLive || n < 10) continue;
      const Vec2 e = rig.track().uv_px - place;
      nees += e.dot(rig.track().cov_px2.inverse() * e) / 2;
      squared[0] += e.squaredNorm();
      squared[1] += (other.track().uv_px - place).squaredNorm();
      ++count;
    }
  }
  ASSERT_GT(count, 4000);
  EXPECT_NEAR(nees / count, 1, 0.08);
  EXPECT_LT(squared[0], 0.75 * squared[1]);
}

/// Something that swings by 60 px, 1.5 times in 2 s.
Vec2 swing(double t) { return {500 + 60 * std::sin(1.5 * std::numbers::pi * t), 500 + 20 * std::sin(1.5 * std::numbers::pi * t + 1)}; }

TEST(Kalman, ATrackWithoutCornersMovesAsNavigationsRatesSay) {
  TrackRig led(kalman()), blind(kalman());
  double t = 0;
  for (TrackRig* r : {&led, &blind}) { r->begin(); r->nav({swing(0)}, 1); r->hit(swing(0), 0.1); }
  double worst_led = 0, worst_blind = 0;
  for (int n = 1; n <= 60; ++n) {
    const Vec2 way = swing(n * T) - swing((n - 1) * T);
    t = n * T;
    led.begin_moved({way});
    blind.begin();
    if (n < 30) {
      for (TrackRig* r : {&led, &blind}) r->hit(swing(t), 0.1);
    } else {
      for (TrackRig* r : {&led, &blind}) r->miss();
      worst_led = std::max(worst_led, (led.track().uv_px - swing(t)).norm());
      worst_blind = std::max(worst_blind, (blind.track().uv_px - swing(t)).norm());
    }
  }
  EXPECT_LT(worst_led, 0.3) << "a second without a corner";
  EXPECT_GT(worst_blind, 50);
}

TEST(Kalman, WhereRatesBeginTheyAreAMeasurementOfTheVelocity) {
  TrackConfig config = kalman();
  TrackRig rig(config);
  rig.begin();
  rig.nav({{400, 300}}, 4);
  Textbook want({400, 300}, 4, config.velocity_sigma_px_s, config.acceleration_px2_s3);
  for (int n = 0; n < 5; ++n) {
    rig.hit({400.0 + n, 300}, 0.5);
    want.place({400.0 + n, 300}, 0.25 * Mat2::Identity());
    rig.begin();
    want.predict();
  }
  const double age = 0.2;  // and of an update that old they are less certain
  rig.begin_moved({Vec2(50 * T, -10 * T)}, age);
  want.velocity({50, -10}, (config.rate_sigma_px_s * config.rate_sigma_px_s + config.acceleration_px2_s3 * age) * Mat2::Identity());
  want.predict();
  expect_same(rig.track(), want, 5);
}

TEST(Kalman, HeldRatesDoNotDrawTheTrackBackButANewUpdateDoes) {
  TrackConfig config = kalman();
  config.acceleration_px2_s3 = 2000;
  TrackRig rig(config);
  rig.begin();
  rig.nav({{400, 300}}, 1);
  rig.hit({400, 300}, 0.1);
  for (int n = 1; n <= 30; ++n) {  // the rates of the first frame say that it stands; it moves at 60 px/s
    rig.begin_moved({Vec2::Zero()}, n * T);
    rig.hit({400 + 60 * n * T, 300}, 0.1);
  }
  EXPECT_NEAR(rig.track().velocity_px_s.x(), 60, 0.5);
  rig.begin_moved({Vec2(90 * T, 0)});
  EXPECT_GT(rig.track().velocity_px_s.x(), 75) << "the new update is more certain than the corners";
  EXPECT_LT(rig.track().velocity_px_s.x(), 90);
}

TEST(Kalman, ATrackStartsWithTheVelocityOfTheRates) {
  TrackRig rig(kalman());
  rig.begin();
  rig.nav({{100, 100}});
  rig.begin_moved({Vec2(3, 1)});
  rig.nav({{300, 100}});
  EXPECT_LT((rig.track().velocity_px_s - Vec2(3, 1) / T).norm(), 1e-6) << "and not that of the difference of the two updates";
  rig.begin_moved({Vec2(3, 1)});
  EXPECT_LT((rig.track().uv_px - Vec2(303, 101)).norm(), 1e-6);
}

TEST(Kalman, OtherFiltersTakeNoNoticeOfRates) {
  for (const Filter filter : {Filter::kZohScore, Filter::kAlphaBeta}) {
    TrackConfig config = kalman();
    config.filter = filter;
    TrackRig rig(config);
    rig.begin();
    rig.nav({{100, 100}});
    rig.hit({100, 100});
    rig.begin_moved({Vec2(5, 5)});
    EXPECT_EQ(rig.track().uv_px, Vec2(100, 100));
  }
}

TEST(Kalman, AFeatureBehindTheCameraAndAFrameThatIsNotLaterSayNothing) {
  TrackRig rig(kalman());
  rig.begin();
  rig.nav({{100, 100}});
  rig.hit({100, 100});
  rig.begin_moved({std::nullopt});
  EXPECT_EQ(rig.track().uv_px, Vec2(100, 100));
  rig.begin_moved({Vec2(5, 5)}, 0, Duration{0});
  EXPECT_EQ(rig.track().uv_px, Vec2(100, 100));
  EXPECT_TRUE(rig.track().cov_px2.allFinite());
}

}  // namespace
}  // namespace cyclops
