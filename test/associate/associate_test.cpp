#include "associate/associate.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <set>

#include "test/associate/exact.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

struct Frame {
  std::unique_ptr<TrackSet> tracks{std::make_unique<TrackSet>()};
  std::unique_ptr<CornerSet> corners{std::make_unique<CornerSet>()};
  std::unique_ptr<MatchSet> matches{std::make_unique<MatchSet>()};
  void track(double u, double v, double sigma = 1, TrackState state = TrackState::kLive) {
    Track t;
    t.state = state;
    t.uv_px = {u, v};
    t.cov_px2 = Mat2::Identity() * sigma * sigma;
    tracks->push_back(t);
  }
  void corner(double u, double v, double sigma = 0.3) {
    Corner c;
    c.uv_px = {u, v};
    c.cov_px2 = Mat2::Identity() * sigma * sigma;
    corners->items.push_back(c);
  }
  const MatchSet& associate(const AssociateConfig& config) {
    Associator(config).associate(*tracks, *corners, *matches);
    return *matches;
  }
};

AssociateConfig fixed(double gate_px) {
  AssociateConfig c;
  c.gate_px = gate_px;
  return c;
}

AssociateConfig mahalanobis() {
  AssociateConfig c;
  c.gate = Gate::kMahalanobis;
  return c;
}

// Spec 2.5: greedy would take T1-O3, T2-O4 and starve T3.
TEST(Associate, FindsTheBestTotalOfTheWorkedExample) {
  Frame f;
  for (const double u : {413.0, 416.0, 426.0}) f.track(u, 300);
  f.track(470, 340);
  for (const double u : {407.0, 409.0, 414.0, 419.0}) f.corner(u, 300);
  f.corner(500, 250);
  const MatchSet& m = f.associate(fixed(13));
  ASSERT_EQ(m.size(), 4U);
  const std::int32_t want[4] = {1, 2, 3, -1};
  const double gain[4] = {9, 11, 6, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(m[i].corner, want[i]);
    EXPECT_DOUBLE_EQ(m[i].gain_px, gain[i]);
    EXPECT_EQ(m[i].reason, i < 3 ? MatchReason::kMatched : MatchReason::kNoCornerInGate);
    EXPECT_FLOAT_EQ(m[i].gate_px, 13);
  }
}

TEST(Associate, LeavesACornerOutsideEveryGateUnmatched) {
  for (const double gate : {6.0, 9.0, 13.0, 16.0}) {
    Frame f;
    f.track(413, 300);
    f.corner(413 + gate + 0.001, 300);
    EXPECT_EQ(f.associate(fixed(gate))[0].reason, MatchReason::kNoCornerInGate);
    f.corner(413, 300 - gate);
    EXPECT_EQ(f.associate(fixed(gate))[0].corner, 1) << "the gate's rim belongs to the gate";
  }
}

TEST(Associate, SaysWhetherATrackHadNoCornerOrLostIt) {
  Frame f;
  f.track(100, 100);
  f.track(105, 100);
  f.track(300, 300);
  f.corner(101, 100);
  const MatchSet& m = f.associate(fixed(13));
  EXPECT_EQ(m[0].reason, MatchReason::kMatched);
  EXPECT_EQ(m[1].reason, MatchReason::kLostToOther);
  EXPECT_EQ(m[2].reason, MatchReason::kNoCornerInGate);
  EXPECT_EQ(m[1].corner, -1);
  EXPECT_EQ(m[1].gain_px, 0);
}

TEST(Associate, MatchesCoastingTracksAndPassesOverDeletedOnes) {
  Frame f;
  f.track(100, 100, 1, TrackState::kDeleted);
  f.track(100, 100, 1, TrackState::kNone);
  f.track(104, 100, 1, TrackState::kCoasting);
  f.corner(100, 100);
  const MatchSet& m = f.associate(fixed(13));
  EXPECT_EQ(m[0].reason, MatchReason::kNotVisible);
  EXPECT_EQ(m[1].reason, MatchReason::kNotVisible);
  EXPECT_EQ(m[2].corner, 0);
}

TEST(Associate, TakesTheNumberOfPairsFirstWhenTheBonusIsLargeEnough) {
  Frame f;  // gains T1-O1 10, T1-O2 1, T2-O1 1: errata E15
  f.track(100, 100);
  f.track(115, 100);
  f.corner(103, 100);
  f.corner(88, 100);
  AssociateConfig config = fixed(13);
  EXPECT_EQ(f.associate(config)[0].corner, 0);
  EXPECT_EQ((*f.matches)[1].reason, MatchReason::kLostToOther);
  config.cardinality_bonus_px = 2 * 13 + 1;
  EXPECT_EQ(f.associate(config)[0].corner, 1);
  EXPECT_EQ((*f.matches)[1].corner, 0);
  EXPECT_DOUBLE_EQ((*f.matches)[0].gain_px, 1) << "the bonus is not part of what is reported";
}

// Random frames: the cell list must find what comparing all with all finds, so the total equals the exact one.
TEST(Associate, ReachesTheExactTotalOfAllPairsInRandomFrames) {
  test::Random random(21);
  std::uniform_real_distribution<double> side(-20, 140);
  for (int n = 0; n < 300; ++n) {
    Frame f;
    for (int i = 0; i < 12; ++i) f.track(side(random), side(random));
    for (int j = 0; j < 40; ++j) f.corner(side(random), side(random));
    for (const double gate : {6.0, 16.0}) {
      test::Gains gain(12, std::vector<double>(40));
      for (std::size_t i = 0; i < 12; ++i)
        for (std::size_t j = 0; j < 40; ++j) gain[i][j] = gate - ((*f.tracks)[i].uv_px - f.corners->items[j].uv_px).norm();
      double total = 0;
      std::set<std::int32_t> used;
      for (const Match& m : f.associate(fixed(gate))) {
        total += m.gain_px;
        if (m.corner >= 0) { ASSERT_TRUE(used.insert(m.corner).second); }
      }
      const double gap = test::best_by_kuhn_munkres(gain, 40) - total;
      ASSERT_GE(gap, -1e-9);
      ASSERT_LE(gap, 12 * 0.01);
    }
  }
}

TEST(Associate, MahalanobisGateFollowsTheShapeOfTheCovariance) {
  Frame f;
  f.track(100, 100);
  (*f.tracks)[0].cov_px2 << 16, 0, 0, 0.25;
  f.corner(100, 107);
  EXPECT_EQ(f.associate(mahalanobis())[0].reason, MatchReason::kNoCornerInGate);
  f.corner(109, 100);
  EXPECT_EQ(f.associate(mahalanobis())[0].corner, 1);
  EXPECT_GT((*f.matches)[0].gate_px, 12);
}

TEST(Associate, MahalanobisGateNeverReachesFurtherThanItsBound) {
  Frame f;
  AssociateConfig config = mahalanobis();
  config.clutter_per_px2 = 1e-9;
  f.track(100, 100, 50);
  f.corner(100 + config.max_gate_px + 0.1, 100);
  EXPECT_EQ(f.associate(config)[0].reason, MatchReason::kNoCornerInGate);
  EXPECT_FLOAT_EQ((*f.matches)[0].gate_px, static_cast<float>(config.max_gate_px));
  f.corner(100 - config.max_gate_px + 0.1, 100);
  EXPECT_EQ(f.associate(config)[0].corner, 1);
}

// Likelihood ratio by hand: ln(0.8 / (0.2 * 0.001 * 2 pi * sqrt|S|)) - d2/2, S = (1 + 0.09 + 1) I, d = 2 px.
TEST(Associate, MahalanobisGainIsTheLogLikelihoodRatio) {
  Frame f;
  f.track(100, 100);
  f.corner(102, 100);
  const double s = 1 + 0.09 + 1;
  EXPECT_NEAR(f.associate(mahalanobis())[0].gain_px, std::log(0.8 / (0.2 * 0.001 * 2 * 3.14159265358979 * s)) - 0.5 * 4 / s, 1e-9);
}

TEST(Associate, ACertainTrackOutbidsAnUncertainOneForTheSameCorner) {
  Frame f;
  f.track(100, 100, 5);
  f.track(102, 100, 0.5);
  f.corner(101, 100);
  const MatchSet& m = f.associate(mahalanobis());
  EXPECT_EQ(m[1].corner, 0);
  EXPECT_EQ(m[0].reason, MatchReason::kLostToOther);
}

TEST(Associate, PointsThatAreNotFiniteMatchNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const AssociateConfig& config : {fixed(13), mahalanobis()}) {
    Frame f;
    f.track(100, 100);
    f.track(nan, 100);
    f.track(1e300, -1e300);
    f.corner(nan, 0);
    f.corner(inf, 100);
    f.corner(101, 100, nan);
    f.corner(102, 100);
    const MatchSet& m = f.associate(config);
    EXPECT_EQ(m[0].corner, config.gate == Gate::kFixed ? 2 : 3);
    EXPECT_EQ(m[1].corner, -1);
    EXPECT_EQ(m[2].corner, -1);
  }
}

TEST(Associate, KeepsTheBestCornersOfAnOverfullGateAndCountsIt) {
  Frame f;
  f.track(100, 100);
  for (int j = 0; j < 200; ++j) f.corner(100 + 12.0 * (199 - j) / 200 + 0.01, 100);
  AssociateConfig config = fixed(13);
  Associator associator(config);
  associator.associate(*f.tracks, *f.corners, *f.matches);
  EXPECT_EQ((*f.matches)[0].corner, 199);
  EXPECT_EQ(associator.counters().gates_thinned, 1U);
  EXPECT_EQ(associator.counters().candidates, Associator::kMaxPerGate);
}

TEST(Associate, CountsFramesWhoseAuctionHadToRaiseEpsilon) {
  Frame f;
  for (int i = 0; i < 20; ++i) f.track(100, 100);
  for (int j = 0; j < 30; ++j) f.corner(101, 100);
  AssociateConfig config = fixed(13);
  config.epsilon_px = 1e-5;
  config.max_bids = 500;
  Associator associator(config);
  associator.associate(*f.tracks, *f.corners, *f.matches);
  EXPECT_EQ(associator.counters().epsilon_raised, 1U);
  EXPECT_GT(associator.last_epsilon(), 1e-5);
  for (const Match& m : *f.matches) EXPECT_GE(m.corner, 0);
}

TEST(Associate, ConfigurationRefusesAnUnknownGateAndAnEpsilonOfZero) {
  for (const char* text : {"[associate]\ngate = \"square\"\n", "[associate]\nepsilon_px = 0.0\n", "[associate]\ngates = 3\n"}) {
    auto file = ConfigFile::parse(text, "profile").value();
    auto table = file.root().table("associate");
    (void)AssociateConfig::read(table, {});
    EXPECT_FALSE(file.finish().ok()) << text;
  }
}

}  // namespace
}  // namespace cyclops
