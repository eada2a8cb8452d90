#include "track/motion_check.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>

namespace cyclops {
namespace {

constexpr double kFrame_s = 1.0 / 30;

MotionConfig on() {
  MotionConfig c;
  c.window_s = 0.7;
  return c;
}

/// A group of features that move together, with noise, and one that does what the test says.
class Group {
 public:
  explicit Group(const MotionConfig& config, std::size_t n = 12) : check_(config), n_(n) {}

  /// One frame. `pose`: error of the expected places; `odd`: how far the point that feature 0 follows is off. Is feature 0 still matched?
  bool frame(const Vec2& pose, const Vec2& odd, double sigma_px = 0.3) {
    std::normal_distribution<double> noise(0, sigma_px);
    expected_->items.clear();
    tracks_->clear();
    corners_->items.clear();
    matches_->clear();
    ++frame_;
    for (std::size_t i = 0; i < n_; ++i) {
      const Vec2 truth(100 + 30 * static_cast<double>(i) + 0.5 * frame_, 300 - 0.3 * frame_);
      Prediction p;
      p.feature = static_cast<std::uint16_t>(i);
      p.uv_px = truth + pose;
      expected_->items.push_back(p);
      Track t;
      t.feature = static_cast<std::uint16_t>(i);
      t.state = TrackState::kLive;
      tracks_->push_back(t);
      Corner c;
      c.uv_px = truth + Vec2(noise(random_), noise(random_)) + (i == 0 ? odd : Vec2(0, 0));
      c.cov_px2 = sigma_px * sigma_px * Mat2::Identity();
      corners_->items.push_back(c);
      Match m;
      m.corner = static_cast<std::int32_t>(i);
      m.reason = MatchReason::kMatched;
      matches_->push_back(m);
    }
    refused_ += check_.step(Time{1'000'000'000 + frame_ * 33'333'333LL}, expected_.get(), *tracks_, *corners_, *matches_);
    return (*matches_)[0].corner == 0;
  }
  [[nodiscard]] const Match& first() const { return (*matches_)[0]; }
  [[nodiscard]] std::size_t refused() const { return refused_; }
  MotionCheck& check() { return check_; }

 private:
  MotionCheck check_;
  std::size_t n_;
  int frame_{0};
  std::size_t refused_{0};
  std::mt19937 random_{77};
  std::unique_ptr<PredictionSet> expected_{std::make_unique<PredictionSet>()};
  std::unique_ptr<TrackSet> tracks_{std::make_unique<TrackSet>()};
  std::unique_ptr<CornerSet> corners_{std::make_unique<CornerSet>()};
  std::unique_ptr<MatchSet> matches_{std::make_unique<MatchSet>()};
};

/// Frames until feature 0 is refused when it slides at this speed; 0: never in three seconds.
int frames_to_refusal(double px_s) {
  Group g(on());
  for (int k = 1; k <= 90; ++k)
    if (!g.frame({0, 0}, {px_s * k * kFrame_s, 0})) return k;
  return 0;
}

TEST(MotionCheck, ATrackThatFollowsSomethingElseIsRefusedTheSoonerTheFaster) {
  const int fast = frames_to_refusal(30), slow = frames_to_refusal(8);
  EXPECT_GT(fast, 0);
  EXPECT_LE(fast, 10);
  EXPECT_GT(slow, 0);
  EXPECT_LE(slow, 30);
  EXPECT_LE(fast, slow);
}

TEST(MotionCheck, SaysWhy) {
  Group g(on());
  int k = 0;
  while (g.frame({0, 0}, {0, 0.6 * ++k})) ASSERT_LT(k, 60);
  EXPECT_EQ(g.first().reason, MatchReason::kAgainstMotion);
  EXPECT_EQ(g.first().corner, -1);
}

TEST(MotionCheck, FeaturesThatMoveAsExpectedAreLeftAlone) {
  // GIVEN 12 features, 600 frames, noise as stated
  // THEN hardly one match in ten thousand is refused
  Group g(on());
  for (int k = 0; k < 600; ++k) g.frame({0, 0}, {0, 0});
  EXPECT_LE(g.refused(), 1U);
}

TEST(MotionCheck, AConstantOffsetIsNoMotion) {
  Group g(on());
  for (int k = 0; k < 60; ++k) EXPECT_TRUE(g.frame({0, 0}, {4, -3}));
}

TEST(MotionCheck, APoseThatDriftsIsNobodysWrongMotion) {
  // GIVEN expected places that all drift by 20 px/s, as navigation's do
  // THEN no feature is refused
  Group g(on());
  for (int k = 0; k < 60; ++k) g.frame({20 * k * kFrame_s, 0}, {0, 0});
  EXPECT_EQ(g.refused(), 0U);
}

TEST(MotionCheck, OneThatGoesOnWithADriftingPoseIsFound) {
  // GIVEN a pose that drifts, and one point that drifts with it: it stays where it is expected, and is the only one to
  Group g(on());
  bool refused = false;
  for (int k = 0; k < 30; ++k) refused |= !g.frame({20 * k * kFrame_s, 0}, {20 * k * kFrame_s, 0});
  EXPECT_TRUE(refused);
}

TEST(MotionCheck, AnotherCornerBeginsAnewAndIsInnocent) {
  Group g(on());
  for (int k = 1; k <= 60; ++k) g.frame({0, 0}, {20 * k * kFrame_s, 0});
  ASSERT_EQ(g.first().reason, MatchReason::kAgainstMotion);
  // WHEN the match jumps back to the feature
  for (int k = 0; k < 30; ++k) EXPECT_TRUE(g.frame({0, 0}, {0, 0})) << "frame " << k;
}

TEST(MotionCheck, IsOffWithoutAWindow) {
  MotionConfig off;
  off.window_s = 0;
  Group g(off);
  for (int k = 0; k < 60; ++k) EXPECT_TRUE(g.frame({0, 0}, {2.0 * k, 0}));
}

}  // namespace
}  // namespace cyclops
