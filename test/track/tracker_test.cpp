// The life of a track (spec 2.7) and blending with navigation (spec 2.8).
#include "track/tracker.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "test/track/rig.hpp"

namespace cyclops {
namespace {

using test::thesis;
using test::TrackRig;

TrackConfig alpha_beta_thesis(int delete_at) {
  TrackConfig c = thesis(Filter::kAlphaBeta);
  c.delete_at_score = delete_at;
  return c;
}

// Spec 2.7, N_del 3: h m m h m m -> 0 1 2 1 2 3 = deleted at the sixth frame.
TEST(Tracker, ScoresHitsAndMissesAsInTheSpecification) {
  TrackRig rig(alpha_beta_thesis(3));
  rig.begin();
  rig.nav({{100, 100}});
  const std::string frames = "hmmhmm";
  const int score[6] = {0, 1, 2, 1, 2, 3};
  for (std::size_t n = 0; n < 6; ++n) {
    if (frames[n] == 'h') rig.hit({100, 100}); else rig.miss();
    EXPECT_EQ(rig.track().score, score[n]) << n;
    EXPECT_EQ(rig.track().state, n == 5 ? TrackState::kDeleted : frames[n] == 'h' ? TrackState::kLive : TrackState::kCoasting) << n;
    if (n < 5) rig.begin();
  }
  EXPECT_EQ(rig.track().change, TrackChange::kDeletedByScore);
  EXPECT_EQ(rig.counters().dropped, 1U);
  EXPECT_EQ(rig.counters().hits, 2U);
  EXPECT_EQ(rig.counters().misses, 4U);
}

TrackConfig by_likelihood() {
  TrackConfig c = thesis(Filter::kAlphaBeta);
  c.score = TrackScore::kLikelihood;
  c.delete_at_score = 1000;
  return c;
}

TEST(Tracker, ALikelihoodScoreIsTheSumOfItsFrames) {
  TrackConfig config = by_likelihood();
  config.score_most = 1000;
  TrackRig rig(config);
  rig.begin();
  rig.nav({{100, 100}}, 1.0);
  rig.hit({101, 100}, 1.0);  // S = 2 I, one half of squared innovation over S is 1/4
  const double hit = std::log(0.8 / (0.001 * 2 * 3.14159265358979 * 2)) - 0.25;
  EXPECT_NEAR(rig.track().log_likelihood, hit, 1e-9);
  rig.begin();
  rig.miss();
  EXPECT_NEAR(rig.track().log_likelihood, hit + std::log(0.2), 1e-9);
}

TEST(Tracker, ALikelihoodScoreEndsATrackThatHasFallenTooFarWhateverItWas) {
  // log(1 - 0.8) is -1.61 a miss, so the fourth passes 6; a long life before makes no difference, for the score is cut off
  for (const int hits : {0, 3, 200}) {
    TrackRig rig(by_likelihood());
    rig.begin();
    rig.nav({{100, 100}});
    for (int n = 0; n < hits; ++n) { rig.hit({100, 100}); rig.begin(); }
    for (int n = 1; n <= 4; ++n) {
      rig.miss();
      EXPECT_EQ(rig.track().state, n < 4 ? TrackState::kCoasting : TrackState::kDeleted) << hits << " hits, miss " << n;
      if (n < 4) rig.begin();
    }
    EXPECT_EQ(rig.track().change, TrackChange::kDeletedByScore);
  }
}

TEST(Tracker, HitsFarFromWhereTheyShouldBeLowerTheLikelihood) {
  TrackRig near(by_likelihood()), far(by_likelihood());
  for (TrackRig* rig : {&near, &far}) {
    rig->begin();
    rig->nav({{100, 100}}, 1.0);
    rig->hit({rig == &near ? 100.0 : 104.0, 100});
  }
  EXPECT_LT(far.track().log_likelihood, near.track().log_likelihood);
}

TEST(Tracker, AMatchAgainstTheMotionEndsTheTrackUntilNavigationStartsItAgain) {
  TrackRig rig(alpha_beta_thesis(5));
  rig.begin();
  rig.nav({{100, 100}});
  rig.hit({100, 100});
  rig.begin();
  rig.miss(MatchReason::kAgainstMotion);
  EXPECT_EQ(rig.track().change, TrackChange::kAgainstMotion);
  EXPECT_EQ(rig.track().state, TrackState::kDeleted);
  EXPECT_EQ(rig.counters().against_motion, 1U);
  EXPECT_EQ(rig.counters().dropped, 0U);
  rig.begin();
  rig.hit({100, 100});
  EXPECT_EQ(rig.track().state, TrackState::kDeleted);
  rig.begin();
  rig.nav({{100, 100}});
  EXPECT_EQ(rig.track().state, TrackState::kLive);
}

TEST(Tracker, ScoreNeverFallsBelowZero) {
  TrackRig rig(alpha_beta_thesis(2));
  rig.begin();
  rig.nav({{100, 100}});
  for (int n = 0; n < 5; ++n) { rig.hit({100, 100}); rig.begin(); }
  EXPECT_EQ(rig.track().score, 0);
  rig.miss();
  EXPECT_EQ(rig.track().score, 1);
}

TEST(Tracker, ZeroOrderHoldOfTheThesisDiesAtTheFirstMissAndWithAScoreItLives) {
  TrackRig zoh(thesis(Filter::kZoh)), scored(thesis(Filter::kZohScore));
  for (TrackRig* rig : {&zoh, &scored}) {
    rig->begin();
    rig->nav({{100, 100}});
    rig->hit({102, 100});
    rig->begin();
    rig->miss();
  }
  EXPECT_EQ(zoh.track().state, TrackState::kDeleted);
  EXPECT_EQ(scored.track().state, TrackState::kCoasting);
  EXPECT_EQ(scored.track().uv_px, Vec2(102, 100));
}

TEST(Tracker, ADeletedTrackStaysOffUntilTheNextNavigationUpdate) {
  TrackRig rig(alpha_beta_thesis(1));
  rig.begin();
  rig.nav({{100, 100}});
  rig.miss();
  for (int n = 0; n < 3; ++n) {
    rig.begin();
    rig.hit({100, 100});
    EXPECT_EQ(rig.track().state, TrackState::kDeleted);
  }
  rig.begin();
  rig.nav({{105, 100}});
  EXPECT_EQ(rig.track().change, TrackChange::kInitiatedByNav);
  EXPECT_EQ(rig.track().score, 0);
  EXPECT_EQ(rig.track().uv_px, Vec2(105, 100));
  EXPECT_EQ(rig.counters().initiated, 2U);
}

TEST(Tracker, StartsNothingWithoutNavigation) {
  TrackRig rig(TrackConfig{});
  rig.begin();
  rig.update({});
  EXPECT_TRUE((*rig).tracks().empty());
  auto none = std::make_unique<PredictionSet>();
  (*rig).nav_update(*none);
  EXPECT_TRUE((*rig).tracks().empty());
}

TEST(Tracker, AStartShowsAsInitiatedWhetherItsFirstFrameHitsOrMisses) {
  TrackRig rig(TrackConfig{});
  rig.begin();
  rig.nav({{100, 100}, {200, 200}});
  rig.update({Vec2(101, 100), std::nullopt});
  EXPECT_EQ(rig.track(0).change, TrackChange::kInitiatedByNav);
  EXPECT_EQ(rig.track(0).state, TrackState::kLive);
  EXPECT_EQ(rig.track(1).change, TrackChange::kInitiatedByNav);
  EXPECT_EQ(rig.track(1).state, TrackState::kCoasting);
  rig.begin();
  rig.update({Vec2(101, 100), std::nullopt});
  EXPECT_EQ(rig.track(0).change, TrackChange::kHit);
  EXPECT_EQ(rig.track(1).change, TrackChange::kMiss);
}

TEST(Tracker, LeavingTheImageEndsATrackWithoutCountingItAsDropped) {
  TrackRig rig(thesis(Filter::kAlphaBeta));
  rig.begin();
  rig.nav({{1000, 500}});
  rig.hit({1000, 500});
  rig.begin();
  rig.nav({{1010, 500}});  // 300 px/s
  rig.hit({1010, 500});
  rig.begin();
  EXPECT_EQ(rig.track().state, TrackState::kLive);
  rig.miss();
  rig.begin();
  EXPECT_EQ(rig.track().state, TrackState::kNone);
  EXPECT_EQ(rig.track().change, TrackChange::kLeftImage);
  EXPECT_EQ(rig.counters().left_image, 1U);
  EXPECT_EQ(rig.counters().dropped, 0U);
}

TEST(Tracker, NavigationBringsBackATrackThatLeftTheImageOnlyByItsOwnAccount) {
  TrackRig rig(thesis(Filter::kAlphaBeta));
  rig.begin();
  rig.nav({{1000, 500}});
  rig.hit({1000, 500});
  rig.begin();
  rig.nav({{1020, 500}});
  rig.hit({1020, 500});
  rig.begin();
  EXPECT_EQ(rig.track().change, TrackChange::kLeftImage);
  rig.nav({{1015, 500}});
  EXPECT_EQ(rig.track().change, TrackChange::kReplacedByNav);
  EXPECT_EQ(rig.counters().left_image, 0U);
}

TEST(Tracker, NavigationEndsTracksThatLeftTheImageOrTurnedAway) {
  for (const Visibility v : {Visibility::kOutsideImage, Visibility::kBehindCamera, Visibility::kFacingAway, Visibility::kHidden}) {
    TrackRig rig(thesis(Filter::kAlphaBeta));
    rig.begin();
    rig.nav({{1000, 500}});
    rig.hit({1000, 500});
    rig.begin();
    rig.nav({{1100, 500}}, 3, v);
    const bool left = v == Visibility::kOutsideImage || v == Visibility::kBehindCamera;
    EXPECT_EQ(rig.track().state, TrackState::kNone);
    EXPECT_EQ(rig.track().change, left ? TrackChange::kLeftImage : TrackChange::kTurnedAway);
    EXPECT_EQ(rig.counters().left_image + rig.counters().turned_away, 1U);
    EXPECT_EQ(rig.counters().dropped, 0U);
  }
}

// Spec 2.8.
TEST(Tracker, NavWinsReplacesPositionResetsTheScoreAndTakesTheVelocityFromTwoUpdates) {
  TrackRig rig(alpha_beta_thesis(5));
  rig.begin();
  rig.nav({{100, 100}});
  EXPECT_EQ(rig.track().velocity_px_s, Vec2(0, 0)) << "first update";
  rig.hit({108, 100});
  rig.begin();
  rig.miss();
  rig.begin();
  rig.nav({{104, 98}});
  EXPECT_EQ(rig.track().change, TrackChange::kReplacedByNav);
  EXPECT_EQ(rig.track().uv_px, Vec2(104, 98));
  EXPECT_EQ(rig.track().score, 0);
  EXPECT_NEAR(rig.track().velocity_px_s.x(), 4 / (2 * test::kFrame.seconds()), 1e-9);
  EXPECT_NEAR(rig.track().velocity_px_s.y(), -2 / (2 * test::kFrame.seconds()), 1e-9);
}

TEST(Tracker, TakesNoVelocityFromUpdatesFurtherApartThanTheLimit) {
  for (const auto& [gap, moves] : {std::pair{2.0, true}, std::pair{2.001, false}}) {
    TrackRig rig(thesis(Filter::kAlphaBeta));
    rig.begin();
    rig.nav({{100, 100}});
    rig.begin(Duration::from_seconds(gap));
    rig.nav({{110, 100}});
    EXPECT_EQ(rig.track().velocity_px_s.x() != 0, moves) << gap;
  }
}

TEST(Tracker, AConstantProjectionBiasCancelsInTheVelocity) {
  TrackRig rig(thesis(Filter::kAlphaBeta));
  rig.begin();
  rig.nav({{113, 100}});
  rig.begin(Duration::from_seconds(1));
  rig.nav({{143, 100}});
  EXPECT_NEAR(rig.track().velocity_px_s.x(), 30, 1e-9);
}

/// Ten hits at (108, 100), then a navigation update elsewhere.
TrackRig after_ten_hits(const TrackConfig& config) {
  TrackRig rig(config);
  rig.begin();
  rig.nav({{100, 100}});
  for (int n = 0; n < 10; ++n) { rig.hit({108, 100}); rig.begin(); }
  return rig;
}

TEST(Tracker, AGoodTrackSurvivesAConsistentNavigationUpdateUntouched) {
  TrackRig rig = after_ten_hits(TrackConfig{});
  const Track before = rig.track();
  rig.nav({{100, 100}}, 3);
  EXPECT_EQ(rig.track().uv_px, before.uv_px);
  EXPECT_EQ(rig.track().velocity_px_s, before.velocity_px_s);
  EXPECT_EQ(rig.track().change, TrackChange::kNone);
  EXPECT_EQ(rig.counters().kept, 1U);
  TrackRig thesis_rig = after_ten_hits(thesis(Filter::kAlphaBeta));
  thesis_rig.nav({{100, 100}}, 3);
  EXPECT_EQ(thesis_rig.track().uv_px, Vec2(100, 100));
}

TEST(Tracker, ATrackFarFromACertainNavigationUpdateStartsAnew) {
  TrackRig rig = after_ten_hits(TrackConfig{});
  rig.nav({{100, 100}}, 1);
  EXPECT_EQ(rig.track().uv_px, Vec2(100, 100));
  EXPECT_EQ(rig.track().change, TrackChange::kReplacedByNav);
}

TEST(Tracker, ATrackThatWasNotHitRecentlyIsReplacedEvenWhenConsistent) {
  TrackConfig config;
  config.delete_at_score = 20;
  TrackRig rig = after_ten_hits(config);
  for (int n = 0; n < 5; ++n) { rig.miss(); rig.begin(); }
  rig.nav({{104, 100}}, 3);
  EXPECT_EQ(rig.counters().kept, 1U) << "six frames after its last hit";
  for (int n = 0; n < 2; ++n) { rig.miss(); rig.begin(); }
  rig.nav({{104, 100}}, 3);
  EXPECT_EQ(rig.track().change, TrackChange::kReplacedByNav);
}

TEST(Tracker, ATrackThatNavigationStartedButNoCornerConfirmedIsReplaced) {
  TrackRig rig(TrackConfig{});
  rig.begin();
  rig.nav({{100, 100}});
  rig.begin();
  rig.nav({{101, 100}});
  EXPECT_EQ(rig.track().change, TrackChange::kReplacedByNav);
  EXPECT_EQ(rig.counters().kept, 0U);
}

TEST(Tracker, AGoodTrackAtTheRimIsKeptWhenNavigationPutsItJustOutside) {
  TrackRig rig(TrackConfig{});
  rig.begin();
  rig.nav({{1020, 500}});
  for (int n = 0; n < 10; ++n) { rig.hit({1020, 500}); rig.begin(); }
  rig.nav({{1025, 500}}, 3, Visibility::kOutsideImage);
  EXPECT_EQ(rig.track().state, TrackState::kLive);
  rig.nav({{1025, 500}}, 3, Visibility::kFacingAway);
  EXPECT_EQ(rig.track().change, TrackChange::kTurnedAway);
}

TEST(Tracker, ShowsTheTracksAsAssociationSawThemAfterTheUpdate) {
  TrackRig rig(TrackConfig{});
  rig.begin();
  rig.nav({{100, 100}});
  rig.hit({105, 100});
  EXPECT_EQ((*rig).predicted()[0].uv_px, Vec2(100, 100));
  EXPECT_EQ(rig.track().uv_px, Vec2(105, 100));
  EXPECT_EQ(rig.track().id, 1);
}

TEST(Tracker, ConfigurationRefusesUnstableGains) {
  auto file = ConfigFile::parse("[track]\nalpha = 1.0\nbeta = 2.0\n", "profile").value();
  auto table = file.root().table("track");
  ASSERT_TRUE(TrackConfig::read(table, {}).ok());
  const auto done = file.finish();
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().message().find("unstable"), std::string::npos);
}

TEST(Tracker, ConfigurationReadsTheThesisProfile) {
  auto file = ConfigFile::parse("[track]\nfilter = \"zoh\"\nblending = \"nav-wins\"\nfirst_hit_takes_corner = false\n", "profile").value();
  auto table = file.root().table("track");
  const auto config = TrackConfig::read(table, {}).value();
  ASSERT_TRUE(file.finish().ok());
  EXPECT_EQ(config.filter, Filter::kZoh);
  EXPECT_EQ(config.blending, Blending::kNavWins);
}

}  // namespace
}  // namespace cyclops
