/// Readings kept over frames, and doubt about single matches.
#include <gtest/gtest.h>

#include <memory>

#include "associate/associate.hpp"

namespace cyclops {
namespace {

constexpr std::int64_t kFrame_ns = 33'333'333;

/// Three features 12 px apart, the corner of each where it is. Navigation puts all of them 10 px to the right: the first two next to
/// the corner of their neighbour, the third where there is nothing.
class Bias : public testing::Test {
 protected:
  static constexpr double kPlace[3] = {100, 112, 124};
  static AssociateConfig config(AssociateMethod method) {
    AssociateConfig c;
    c.method = method;
    c.gate_px = 13;
    return c;
  }
  /// One frame; `shift`: of the places that the tracks are given.
  const MatchSet& frame(Associator& associator, double shift, TrackChange change) {
    tracks_->clear();
    corners_->items.clear();
    for (std::size_t i = 0; i < 3; ++i) {
      Track t;
      t.id = static_cast<FeatureId>(i + 1);
      t.feature = static_cast<std::uint16_t>(i);
      t.state = TrackState::kLive;
      t.change = change;
      t.uv_px = {kPlace[i] + shift, 200};
      tracks_->push_back(t);
      Corner c;
      c.uv_px = {kPlace[i], 200};
      corners_->items.push_back(c);
    }
    corners_->t_mid = Time{++frames_ * kFrame_ns};
    associator.associate(*tracks_, *corners_, *matches_);
    return *matches_;
  }
  std::unique_ptr<TrackSet> tracks_{std::make_unique<TrackSet>()};
  std::unique_ptr<CornerSet> corners_{std::make_unique<CornerSet>()};
  std::unique_ptr<MatchSet> matches_{std::make_unique<MatchSet>()};
  std::int64_t frames_{0};
};

// Spec 4.2, the two failures of a poor projection: it misassociates some tracks and starves others.
TEST_F(Bias, TheAuctionMisassociatesTwoTracksAndStarvesTheThird) {
  Associator associator(config(AssociateMethod::kAuction));
  for (int i = 0; i < 5; ++i) frame(associator, 0, TrackChange::kNone);
  const MatchSet& m = frame(associator, 10, TrackChange::kReplacedByNav);
  EXPECT_EQ(m[0].corner, 1);
  EXPECT_EQ(m[1].corner, 2);
  EXPECT_EQ(m[2].corner, -1);
}

TEST_F(Bias, ReadingsKeepEveryTrackOnItsCorner) {
  Associator associator(config(AssociateMethod::kKBest));
  for (int i = 0; i < 5; ++i) frame(associator, 0, TrackChange::kNone);
  for (int k = 0; k < 3; ++k) {
    const MatchSet& m = frame(associator, 10, TrackChange::kReplacedByNav);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(m[i].corner, static_cast<std::int32_t>(i)) << "frame " << k;
      EXPECT_EQ(m[i].reason, MatchReason::kMatched);
    }
  }
}

TEST_F(Bias, NavigationIsBelievedWhereTheTracksHaveLostTheirCorners) {
  // GIVEN tracks that wandered off by 40 px, where nothing is
  Associator associator(config(AssociateMethod::kKBest));
  for (int i = 0; i < 5; ++i) EXPECT_EQ(frame(associator, 40, TrackChange::kNone)[0].corner, -1);
  // WHEN navigation puts them right
  const MatchSet& m = frame(associator, 1, TrackChange::kReplacedByNav);
  // THEN they are matched at once
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(m[i].corner, static_cast<std::int32_t>(i));
}

/// One track and corners for Hypotheses, whose gains the test makes up.
struct One {
  std::unique_ptr<TrackSet> tracks{std::make_unique<TrackSet>()};
  std::unique_ptr<CornerSet> corners{std::make_unique<CornerSet>()};
  std::int64_t frames{0};
  One() {
    Track t;
    t.state = TrackState::kLive;
    t.uv_px = {100, 100};
    tracks->push_back(t);
    for (const double u : {100.0, 110.0}) {
      Corner c;
      c.uv_px = {u, 100};
      corners->items.push_back(c);
    }
  }
  std::size_t begin(Hypotheses& h) { return h.begin(*tracks, Time{++frames * kFrame_ns}); }
};

TEST(Hypotheses, AReadingThatWasSecondWinsWhenTheFramesSpeakForIt) {
  // GIVEN two corners for one track: the wrong one looks a little better in the first frame
  Hypotheses h({}, 8);
  One one;
  const std::int32_t wrong[] = {1}, right[] = {0}, none[] = {-1};
  ASSERT_EQ(one.begin(h), 1U);
  h.judge(0, 2.0, wrong);
  h.judge(0, 1.8, right);
  EXPECT_EQ(h.settle(*one.corners)[0], 1);
  EXPECT_NEAR(h.margin(), 0.2, 1e-12);
  // WHEN the frames after it find only the other corner where that reading expects it
  for (int k = 0; k < 2; ++k) {
    const std::size_t n = one.begin(h);
    ASSERT_EQ(n, 2U);
    for (std::size_t i = 0; i < n; ++i) {
      TrackSet expected;
      h.expected(i, *one.tracks, expected);
      const bool at_right = expected[0].uv_px.x() < 105;
      if (at_right) h.judge(i, 1.8, right);
      else h.judge(i, 0, none);
    }
    // THEN it leads
    EXPECT_EQ(h.settle(*one.corners)[0], 0);
  }
}

TEST(Hypotheses, NavigationsWordMakesEachReadingGoOnInTwo) {
  Hypotheses h({}, 8);
  One one;
  const std::int32_t right[] = {0}, other[] = {1};
  EXPECT_EQ(one.begin(h), 1U);
  h.judge(0, 5, right);
  h.settle(*one.corners);
  (*one.tracks)[0].change = TrackChange::kReplacedByNav;
  (*one.tracks)[0].uv_px = {109, 100};
  ASSERT_EQ(one.begin(h), 2U);
  TrackSet navigation, own;
  h.expected(0, *one.tracks, navigation);
  h.expected(1, *one.tracks, own);
  EXPECT_NEAR(navigation[0].uv_px.x(), 109, 1e-12);
  EXPECT_NEAR(own[0].uv_px.x(), 100, 1e-9);
  h.judge(0, 4, other);
  h.judge(1, 5, right);
  EXPECT_EQ(h.settle(*one.corners)[0], 0);
}

TEST(Hypotheses, AnOwnPlaceThatLeftTheGroupIsPutBackWithTheGroupsShift) {
  // GIVEN five tracks that a reading has where their corners are, the last one 20 px off
  Hypotheses h({}, 8);
  TrackSet tracks;
  CornerSet corners;
  std::vector<std::int32_t> all;
  for (int i = 0; i < 5; ++i) {
    Track t;
    t.state = TrackState::kLive;
    t.uv_px = {100.0 * i + (i == 4 ? 20 : 0), 50};
    tracks.push_back(t);
    Corner c;
    c.uv_px = t.uv_px;
    corners.items.push_back(c);
    all.push_back(i);
  }
  h.begin(tracks, Time{1 * kFrame_ns});
  h.judge(0, 10, all);
  h.settle(corners);
  // WHEN navigation puts every feature 8 px to the left
  for (int i = 0; i < 5; ++i) {
    tracks[static_cast<std::size_t>(i)].change = TrackChange::kReplacedByNav;
    tracks[static_cast<std::size_t>(i)].uv_px = {100.0 * i - 8, 50};
  }
  ASSERT_EQ(h.begin(tracks, Time{2 * kFrame_ns}), 2U);
  // THEN the reading's own places stay, and the fifth comes to where the others say
  TrackSet own;
  h.expected(1, tracks, own);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(own[i].uv_px.x(), 100.0 * static_cast<double>(i), 1e-9);
}

TEST(Hypotheses, NeverKeepsMoreThanItMayAndNoneTwice) {
  Hypotheses h({.most = 3}, 8);
  One one;
  (*one.tracks)[0].change = TrackChange::kReplacedByNav;
  for (int k = 0; k < 50; ++k) {
    const std::size_t n = one.begin(h);
    ASSERT_LE(n, 6U);
    for (std::size_t i = 0; i < n; ++i)
      for (const std::int32_t c : {-1, 0, 1}) h.judge(i, 1.0 + c, std::span(&c, 1));
    h.settle(*one.corners);
    ASSERT_LE(h.size(), 3U);
  }
}

/// Two features `apart` px from each other, tracks sure to half a pixel, and corners.
struct Pair {
  std::unique_ptr<TrackSet> tracks{std::make_unique<TrackSet>()};
  std::unique_ptr<CornerSet> corners{std::make_unique<CornerSet>()};
  std::unique_ptr<MatchSet> matches{std::make_unique<MatchSet>()};
  explicit Pair(double apart, double sigma = 0.5) {
    for (const double u : {100.0, 100.0 + apart}) {
      Track t;
      t.state = TrackState::kLive;
      t.uv_px = {u, 50};
      t.cov_px2 = sigma * sigma * Mat2::Identity();
      tracks->push_back(t);
    }
  }
  void corner(double u, std::int32_t feature = -1) {
    Corner c;
    c.uv_px = {u, 50};
    c.cov_px2 = 0.04 * Mat2::Identity();
    c.feature = feature;
    corners->items.push_back(c);
  }
  static AssociateConfig config(double min_probability) {
    AssociateConfig c;
    c.gate = Gate::kMahalanobis;
    c.model_sigma_px = 0.5;
    c.min_probability = min_probability;
    return c;
  }
  const MatchSet& associate(double min_probability) { return associate(config(min_probability)); }
  const MatchSet& associate(const AssociateConfig& c) {
    Associator(c).associate(*tracks, *corners, *matches);
    return *matches;
  }
};

TEST(Doubt, OneCornerBetweenTwoFeaturesIsNobodys) {
  Pair p(2);
  p.corner(100.9);
  EXPECT_EQ(p.associate(0.9)[0].reason, MatchReason::kAmbiguous);
  EXPECT_EQ((*p.matches)[0].corner, -1);
  EXPECT_EQ((*p.matches)[1].corner, -1);
  EXPECT_EQ(p.associate(0)[0].corner, 0) << "without the test the nearer one has it";
}

TEST(Doubt, ACornerForEachFeatureLeavesNone) {
  Pair p(3);
  p.corner(100.1);
  p.corner(103.1);
  const MatchSet& m = p.associate(0.9);
  EXPECT_EQ(m[0].corner, 0);
  EXPECT_EQ(m[1].corner, 1);
}

TEST(Doubt, ARivalOutsideItsOwnGateStillHasAClaim) {
  // GIVEN gates of 2.5 px and a corner 2 px from one feature, 2.6 px from the other
  Pair p(4.6, 1.2);
  p.corner(102);
  AssociateConfig c = Pair::config(0.9);
  c.max_gate_px = 2.5;
  EXPECT_EQ(p.associate(c)[0].reason, MatchReason::kAmbiguous);
  EXPECT_EQ((*p.matches)[1].reason, MatchReason::kNoCornerInGate);
  c.min_probability = 0;
  EXPECT_EQ(p.associate(c)[0].corner, 0);
}

TEST(Doubt, ThePatchAndTheCornerOfOneFeatureAreNoRivals) {
  Pair p(40);
  p.corner(100.3);
  p.corner(100.6, 0);
  EXPECT_GE(p.associate(0.9)[0].corner, 0);
}

}  // namespace
}  // namespace cyclops
