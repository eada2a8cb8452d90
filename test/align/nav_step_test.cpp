#include "align/nav_step.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "test/support.hpp"

namespace cyclops::align {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr double kTau_s = 40;  // of navigation's errors

Vec6 change(const Vec3& turn, const Vec3& shift) {
  Vec6 d;
  d.head<3>() = turn;
  d.tail<3>() = shift;
  return d;
}
CameraPose pose(const Vec6& d) { return moved({Rotation<frame::C, frame::K>(), Point<frame::C>(0, -2, 30)}, d); }

/// A tanker 30 m ahead that drifts and turns; navigation with slow errors of 0.3 deg and 0.15 m, and the pose the features agree on.
class Sortie {
 public:
  Sortie(std::uint64_t seed, double rate_hz) : random_(seed), step_s_(1 / rate_hz) {
    sigma_ = change(Vec3::Constant(0.3 * kDeg), Vec3::Constant(0.15));
    nav_.P = sigma_.cwiseAbs2().asDiagonal();
    nav_.valid = true;
    error_ = drawn(sigma_);
    seen_.consensus = true;
    const Vec6 fine = change(Vec3::Constant(0.04 * kDeg), Vec3::Constant(0.01));
    seen_.covariance = fine.cwiseAbs2().asDiagonal();
  }
  [[nodiscard]] double t_s() const { return static_cast<double>(frame_) * step_s_; }
  [[nodiscard]] Vec6 true_motion(double t) const {
    return change(Vec3(0.02 * std::sin(0.5 * t), 0.01 * std::sin(0.7 * t), 0.05 * std::sin(0.4 * t)),
                  Vec3(0.5 * std::sin(0.3 * t), 0.4 * std::sin(0.5 * t), -0.4 * t));
  }
  /// One frame: `wrong` is added to what navigation says, `jump` to the pose.
  NavFault fly(NavStep& watch, const Vec6& wrong = Vec6::Zero(), const Vec6& jump = Vec6::Zero(), bool steady = true) {
    const double keep = std::exp(-step_s_ / kTau_s), t = t_s();
    error_ = keep * error_ + std::sqrt(1 - keep * keep) * drawn(sigma_);
    const CameraPose truth = pose(true_motion(t));
    nav_.T = moved(moved(truth, error_), wrong);
    seen_.T_c_k = moved(moved(truth, drawn(seen_.covariance.diagonal().cwiseSqrt() * 0.3)), jump);
    seen_.nav_disagreement = squared_distance(nav_.T, seen_.T_c_k, nav_.P + seen_.covariance);
    const Vec6 per_second = difference(truth, pose(true_motion(t + 1e-3))) / 1e-3;
    watch.before(Time{1'000'000'000 + static_cast<std::int64_t>(t * 1e9)}, nav_, per_second, true);
    watch.after(seen_, steady);
    ++frame_;
    return watch.fault();
  }

 private:
  Vec6 drawn(const Vec6& sigma) {
    Vec6 d;
    for (int i = 0; i < 6; ++i) d[i] = sigma[i] * normal_(random_);
    return d;
  }
  test::Random random_;
  std::normal_distribution<double> normal_;
  double step_s_;
  long frame_{0};
  Vec6 sigma_, error_;
  Prior nav_;
  Alignment seen_;
};

Vec6 shift(double m) { return change(Vec3::Zero(), Vec3(1, 2, -2) / 3 * m); }
Vec6 turn(double deg) { return change(Vec3(2, -1, 2) / 3 * deg * kDeg, Vec3::Zero()); }

/// Frames from the disturbance at 6 s to the fault, which must be `kind`; -1: not within 3 s.
int told_after(std::uint64_t seed, double rate_hz, NavFault kind, const std::function<Vec6(const Sortie&)>& wrong) {
  Sortie s(seed, rate_hz);
  NavStep watch;
  while (s.t_s() < 6 - 1e-9) EXPECT_EQ(s.fly(watch), NavFault::kNone) << "seed " << seed << " at " << s.t_s();
  for (int n = 0; s.t_s() < 9; ++n)
    if (const NavFault found = s.fly(watch, wrong(s)); found != NavFault::kNone) {
      EXPECT_EQ(found, kind) << "seed " << seed;
      return n;
    }
  return -1;
}

TEST(NavStep, HalfAMetreIsToldWithinAThirdOfASecond) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const int n = told_after(seed, 30, NavFault::kPositionStep, [](const Sortie&) { return shift(0.5); });
    EXPECT_GE(n, 0) << "seed " << seed;
    EXPECT_LE(n, 9) << "seed " << seed;
  }
}

TEST(NavStep, TwoDegreesAreToldWithinAThirdOfASecond) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const int n = told_after(seed, 30, NavFault::kAttitudeStep, [](const Sortie&) { return turn(2); });
    EXPECT_GE(n, 0) << "seed " << seed;
    EXPECT_LE(n, 9) << "seed " << seed;
  }
}

TEST(NavStep, AFrozenLinkIsToldAsAMotionThatIsNotWhatItSays) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto behind = [](const Sortie& s) { return change(Vec3::Zero(), Vec3(0, 0, -100 * (s.t_s() - 6 + 0.02))); };
    const int n = told_after(seed, 30, NavFault::kMotion, behind);
    EXPECT_GE(n, 0) << "seed " << seed;
    EXPECT_LE(n, 10) << "seed " << seed;
  }
}

TEST(NavStep, AtOneUpdateASecondTheUpdateThatShowsTheStepStartsATrialAndThePictureEndsIt) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Sortie s(seed, 1);
    NavStep watch;
    while (s.t_s() < 8) ASSERT_EQ(s.fly(watch), NavFault::kNone) << "seed " << seed;
    const double t = s.t_s();
    s.fly(watch, turn(2) + shift(0.8));
    EXPECT_TRUE(watch.held()) << "seed " << seed;
    Alignment seen;
    seen.consensus = true;
    for (int n = 1; n <= 9; ++n) {  // frames without an update
      watch.before(Time{1'000'000'000 + static_cast<std::int64_t>((t + n / 30.0) * 1e9)}, {}, Vec6::Zero(), false);
      watch.after(seen, true);
    }
    EXPECT_NE(watch.fault(), NavFault::kNone) << "seed " << seed;
  }
}

TEST(NavStep, SlowErrorsAloneTellNothingInAnHour) {
  for (const double rate_hz : {30.0, 1.0})
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      Sortie s(seed, rate_hz);
      NavStep watch;
      while (s.t_s() < 300) ASSERT_EQ(s.fly(watch), NavFault::kNone) << "seed " << seed << " at " << s.t_s() << " s, " << rate_hz << " Hz";
    }
}

TEST(NavStep, APoseThatJumpsToOtherCornersIsNotNavigationsFault) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Sortie s(seed, 30);
    NavStep watch;
    while (s.t_s() < 6) s.fly(watch);
    while (s.t_s() < 8) ASSERT_EQ(s.fly(watch, Vec6::Zero(), turn(2)), NavFault::kNone) << "seed " << seed;
    while (s.t_s() < 10) ASSERT_EQ(s.fly(watch), NavFault::kNone) << "seed " << seed;
  }
}

TEST(NavStep, WrongReportsForAFifthOfASecondAreATrialWithoutAFault) {
  for (const int frames : {1, 6}) {
    Sortie s(1, 30);
    NavStep watch;
    while (s.t_s() < 6) s.fly(watch);
    EXPECT_FALSE(watch.held());
    for (int n = 0; n < frames; ++n) {
      EXPECT_EQ(s.fly(watch, shift(3)), NavFault::kNone);
      EXPECT_TRUE(watch.held());
    }
    while (s.t_s() < 7) EXPECT_EQ(s.fly(watch), NavFault::kNone);
    EXPECT_FALSE(watch.held());
  }
}

TEST(NavStep, ItIsOverHalfASecondAfterNavigationIsBack) {
  Sortie s(2, 30);
  NavStep watch;
  while (s.t_s() < 6) s.fly(watch);
  while (s.t_s() < 9) s.fly(watch, shift(0.5));
  ASSERT_EQ(watch.fault(), NavFault::kPositionStep);
  while (s.t_s() < 9 + NavStep::kBack_s) EXPECT_EQ(s.fly(watch), NavFault::kPositionStep);
  while (s.t_s() < 9 + NavStep::kBack_s + 0.2) s.fly(watch);
  EXPECT_EQ(watch.fault(), NavFault::kNone);
  while (s.t_s() < 15) EXPECT_EQ(s.fly(watch), NavFault::kNone);
}

TEST(NavStep, ABiasThatStaysIsAcceptedWhenItIsWithinNavigationsCovarianceAndNeverElse) {
  for (const double size_m : {0.6, 4.0}) {
    Sortie s(3, 30);
    NavStep watch;
    while (s.t_s() < 6) s.fly(watch);
    while (s.t_s() < 6 + NavStep::kAccepted_s - 0.2) s.fly(watch, shift(size_m));
    EXPECT_EQ(watch.fault(), NavFault::kPositionStep) << size_m;
    while (s.t_s() < 6 + NavStep::kAccepted_s + 2) s.fly(watch, shift(size_m));
    EXPECT_EQ(watch.fault(), size_m < 1 ? NavFault::kNone : NavFault::kPositionStep) << size_m;
  }
}

TEST(NavStep, ASilenceForgets) {
  Sortie s(4, 30);
  NavStep watch;
  while (s.t_s() < 6) s.fly(watch);
  while (s.t_s() < 7) s.fly(watch, shift(4));
  ASSERT_EQ(watch.fault(), NavFault::kPositionStep);
  watch.before(Time{1'000'000'000 + 13'000'000'000}, {}, Vec6::Zero(), false);
  EXPECT_EQ(watch.fault(), NavFault::kNone);
  EXPECT_FALSE(watch.held());
}

}  // namespace
}  // namespace cyclops::align
