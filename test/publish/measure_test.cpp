#include "publish/measure.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "associate/associate.hpp"
#include "test/scene.hpp"
#include "test/support.hpp"
#include "track/tracker.hpp"

namespace cyclops {
namespace {

/// One frame of the worked example: tracks from the projection, corners where the test says.
struct Frame {
  Camera camera{{}, {}};
  std::unique_ptr<PredictionSet> predictions{std::make_unique<PredictionSet>()};
  std::unique_ptr<CornerSet> corners{std::make_unique<CornerSet>()};
  std::unique_ptr<MatchSet> matches{std::make_unique<MatchSet>()};
  std::unique_ptr<Tracker> tracker{std::make_unique<Tracker>(TrackConfig{}, 1024, 1024)};
  std::unique_ptr<MeasurementSet> out{std::make_unique<MeasurementSet>()};

  explicit Frame(Windscreen windscreen = {}) : camera({}, std::move(windscreen)) {
    predict(test::example_state(), test::example_model(), camera, test::example_mount(), {}, *predictions);
    tracker->begin_frame(predictions->t_mid);
    tracker->nav_update(*predictions);
  }
  void corner_at(std::size_t feature, const Vec2& offset = {0, 0}) {
    Corner c;
    c.uv_px = predictions->items[feature].uv_px + offset;
    c.cov_px2 = Mat2::Identity() * 0.25;
    c.measure = 7;
    corners->items.push_back(c);
  }
  const MeasurementSet& measured(const PublishConfig& config = {}) {
    Associator({}).associate(tracker->tracks(), *corners, *matches);
    tracker->update(*matches, *corners);
    measure(tracker->predicted(), *matches, *corners, camera, config, *out);
    return *out;
  }
};

void expect_row(const std::array<double, 3>& row, double a, double b, double c) {
  EXPECT_DOUBLE_EQ(row[0], a);
  EXPECT_NEAR(row[1], b, 1e-9);
  EXPECT_NEAR(row[2], c, 1e-9);
}

// Spec 2.9: [12.3 1 1; 2 0 -2.181883e-4; 15 -3.662666e-3 -1.227000e-3].
TEST(Measure, GivesTheZMatrixOfTheSpecification) {
  Frame f;
  f.corner_at(0);
  f.corner_at(3);
  auto z = std::make_unique<ZMatrix>();
  z_matrix(f.measured(), 12.3, *z);
  ASSERT_EQ(z->size(), 3U);
  expect_row((*z)[0], 12.3, 1, 1);
  expect_row((*z)[1], 2, 0, -2.181883e-4);
  expect_row((*z)[2], 15, -3.662666e-3, -1.227000e-3);
}

TEST(Measure, ListsUnobservedFeaturesWithTheirReasonAndKeepsThemOutOfZ) {
  Frame f;
  f.corner_at(1, {2, 1});
  f.corners->seq = 77;
  f.corners->t_mid = Time{5};
  const MeasurementSet& set = f.measured();
  EXPECT_EQ(set.seq, 77U);
  EXPECT_EQ(set.t_mid, Time{5});
  ASSERT_EQ(set.items.size(), 6U);
  for (const Measurement& m : set.items) {
    EXPECT_EQ(m.accepted, m.id == 1);
    EXPECT_EQ(m.reason, m.id == 1 ? MatchReason::kMatched : MatchReason::kNoCornerInGate);
    EXPECT_FLOAT_EQ(m.gate_px, 13);
  }
}

TEST(Measure, ACoastingTrackGivesNoMeasurement) {
  Frame f;
  f.measured();
  f.tracker->begin_frame(Time{} + Duration::from_ms(33));
  ASSERT_EQ(f.tracker->tracks()[0].state, TrackState::kCoasting);
  auto z = std::make_unique<ZMatrix>();
  z_matrix(f.measured(), 0, *z);
  EXPECT_EQ(z->size(), 1U);
  EXPECT_EQ(f.out->integrity, 0);
}

TEST(Measure, RemovesTheWindscreenFromTheMatchedCorner) {
  Frame f(test::example_windscreen());
  f.corner_at(1);
  const Measurement& m = f.measured().items[1];
  EXPECT_NEAR(m.raw_px.x(), 636.425002, 2e-4);
  EXPECT_NEAR(m.ideal_px.x(), 637.380287, 2e-5);
  EXPECT_NEAR(m.ideal_px.y(), 430.032951, 2e-5);
  EXPECT_NEAR(m.z_m.x(), -1.510563e-3, 1e-9);
  EXPECT_NEAR(m.z_m.y(), 9.776046e-4, 1e-9);
}

// The ideal pixel moves by more than the raw one where the windscreen compresses the picture; checked by moving the corner.
TEST(Measure, CarriesTheCornersCovarianceThroughLensAndWindscreen) {
  Intrinsics k;
  k.k1 = -0.25;
  std::vector<float> du(65 * 65), dv(65 * 65);
  for (std::size_t i = 0; i < 65; ++i)
    for (std::size_t j = 0; j < 65; ++j) du[i * 65 + j] = static_cast<float>(-2.0 * static_cast<double>(j));
  Frame f;
  f.camera = Camera(k, Windscreen::from_grids(65, 65, 16, du, dv).value());
  f.corner_at(3);
  f.corners->items[0].cov_px2 << 0.5, 0.1, 0.1, 0.3;
  const Measurement m = f.measured().items[3];
  Mat2 J;
  for (int a = 0; a < 2; ++a) {
    const Vec2 h = 0.1 * Vec2::Unit(a);
    J.col(a) = (f.camera.ideal_from_raw(m.raw_px + h) - f.camera.ideal_from_raw(m.raw_px - h)) / 0.2;
  }
  EXPECT_GT(J(0, 0), 1.1);
  EXPECT_LT((m.cov_px2 - J * f.corners->items[0].cov_px2 * J.transpose()).norm(), 1e-4);
}

TEST(Measure, GivesInnovationWithItsCovarianceAndNis) {
  Frame f;
  f.corner_at(2, {3, -1});
  const Mat2 S = f.tracker->tracks()[2].cov_px2 + 0.25 * Mat2::Identity();
  const Measurement& m = f.measured().items[2];
  EXPECT_LT((m.innovation_px - Vec2(3, -1)).norm(), 1e-12);
  EXPECT_LT((m.innovation_cov_px2 - S).norm(), 1e-12);
  EXPECT_NEAR(m.nis, Vec2(3, -1).dot(S.inverse() * Vec2(3, -1)), 1e-12);
  EXPECT_FLOAT_EQ(m.corner_measure, 7);
}

TEST(Measure, RefusesAMatchWhoseInnovationIsTooLargeAndSaysSo) {
  Frame f;
  f.corner_at(0);
  f.corner_at(2, {12, 0});
  PublishConfig config;
  config.max_nis = 13.8;
  const MeasurementSet& set = f.measured(config);
  EXPECT_TRUE(set.items[0].accepted);
  EXPECT_FALSE(set.items[2].accepted);
  EXPECT_EQ(set.items[2].reason, MatchReason::kInnovation);
  auto z = std::make_unique<ZMatrix>();
  z_matrix(set, 0, *z);
  EXPECT_EQ(z->size(), 2U);
}

TEST(Measure, IntegrityIsOneWhenAllIsWellAndFallsWithMissesInconsistencyAndFewFeatures) {
  Frame all;
  for (std::size_t i = 0; i < 6; ++i) all.corner_at(i);
  EXPECT_DOUBLE_EQ(all.measured().integrity, 1);
  Frame half;
  for (std::size_t i = 0; i < 3; ++i) half.corner_at(i);
  EXPECT_DOUBLE_EQ(half.measured().integrity, 0.5 * 0.5);
  Frame off;
  for (std::size_t i = 0; i < 6; ++i) off.corner_at(i, {i < 3 ? 12.0 : 0.0, 0});
  EXPECT_NEAR(off.measured().integrity, 0.5 / 0.95, 1e-12);
  Frame none;
  EXPECT_EQ(none.measured().integrity, 0);
}

TEST(Measure, ConfigurationNamesAnUnknownKey) {
  auto file = ConfigFile::parse("[publish]\nmax_nis = 13.8\nnis = 3\n", "profile").value();
  auto table = file.root().table("publish");
  EXPECT_DOUBLE_EQ(PublishConfig::read(table, {}).value().max_nis, 13.8);
  ASSERT_FALSE(file.finish().ok());
  EXPECT_NE(file.finish().error().message().find("unknown key"), std::string::npos);
}

TEST(Measure, RefusesWhatCannotBeToldFromItsNeighbour) {
  // GIVEN measurements of two features, the first 1.8 px from where a third one is predicted
  Frame f;
  f.predictions->items[1].uv_px = f.predictions->items[0].uv_px + Vec2(2, 0);
  f.tracker->nav_update(*f.predictions);
  f.corner_at(0, {0.2, 0});
  f.corner_at(3);
  f.measured();
  const auto refused = [&](double apart_sigmas, double sigma_px) {
    for (Measurement& m : f.out->items) m.cov_px2 = sigma_px * sigma_px * Mat2::Identity();
    for (Measurement& m : f.out->items) m.accepted = m.reason == MatchReason::kMatched || m.reason == MatchReason::kAmbiguous;
    refuse_confusable(f.tracker->predicted(), *f.matches, apart_sigmas, *f.out);
    int n = 0;
    for (const Measurement& m : f.out->items) n += m.reason == MatchReason::kAmbiguous && !m.accepted;
    return n;
  };
  EXPECT_EQ(refused(0, 5), 0);
  EXPECT_EQ(refused(1, 0.85), 0);  // half the way is 0.9 px
  EXPECT_EQ(refused(1, 0.95), 1);
  EXPECT_FALSE(f.out->items[0].accepted);
  EXPECT_EQ(f.out->items[0].raw_px, f.corners->items[0].uv_px);
}

TEST(Measure, AFeatureThatIsNotInViewConfusesNothing) {
  Frame f;
  f.predictions->items[1].uv_px = f.predictions->items[0].uv_px + Vec2(2, 0);
  f.predictions->items[1].visibility = Visibility::kHidden;
  f.tracker->nav_update(*f.predictions);
  f.corner_at(0);
  f.measured();
  refuse_confusable(f.tracker->predicted(), *f.matches, 3, *f.out);
  EXPECT_TRUE(f.out->items[0].accepted);
}

}  // namespace
}  // namespace cyclops
