#include "edge/edge_finder.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "align/align.hpp"
#include "test/plate.hpp"

namespace cyclops {
namespace {

double bright(double, double) { return 170; }
double dark(double, double) { return 60; }

class EdgeFinderTest : public ::testing::Test {
 protected:
  /// One frame seen from `truth`, with the pose of alignment `off`.
  void frame(EdgeFinder& finder, const test::CameraPose& real, const test::CameraPose& off, const test::Paint& paint = bright) {
    image = plate.draw(real, paint, dark, ++seed);
    alignment.consensus = true;
    alignment.T_c_k = off;
    plate.predict(off, 0.8, *aligned);
    finder.find(image, nullptr, alignment, *aligned, *edges);
  }
  void prove(EdgeFinder& finder, const test::CameraPose& real) {
    for (int n = 0; n < 8; ++n) {
      frame(finder, real, real);
      finder.learn(alignment, *edges);
    }
  }

  test::Plate plate;
  test::CameraPose truth = test::Plate::pose({0.2, -0.15, 0.1}, {0.2, -0.1, 9});
  ImageView image;
  Alignment alignment;
  std::uint64_t seed{0};
  std::unique_ptr<PredictionSet> aligned = std::make_unique<PredictionSet>();
  std::unique_ptr<EdgeSet> edges = std::make_unique<EdgeSet>();
  std::unique_ptr<CornerSet> corners = std::make_unique<CornerSet>();
};

TEST_F(EdgeFinderTest, FindsTheFourSidesAndNothingElse) {
  // GIVEN a bright plate, six features, so fifteen pairs, of which four are edges
  EdgeFinder finder({}, plate.model, plate.camera);
  prove(finder, truth);
  ASSERT_EQ(edges->size(), 4U);
  for (const Edge& e : *edges) {
    EXPECT_TRUE(e.proven);
    EXPECT_LT(e.feature[1], 4);
    EXPECT_GT(e.coverage, 0.9);
    // THEN its points lie on the true line
    const Vec2 a = plate.at(truth, e.feature[0]), b = plate.at(truth, e.feature[1]);
    const Vec2 across = Vec2(a.y() - b.y(), b.x() - a.x()).normalized();
    for (const Edge::Point& p : {e.inner[0], e.inner[1], e.end[0], e.end[1]}) EXPECT_NEAR(across.dot(p.uv_px - a), 0, 0.12);
  }
}

TEST_F(EdgeFinderTest, CrossingsAreTheCorners) {
  EdgeFinder finder({}, plate.model, plate.camera);
  prove(finder, truth);
  // WHEN the pose is wrong by some 1.5 px and a little turn
  frame(finder, truth, test::Plate::pose({0.203, -0.151, 0.107}, {0.24, -0.07, 9.05}));
  finder.crossings(*edges, *corners);
  ASSERT_EQ(corners->items.size(), 4U);
  for (const Corner& c : corners->items) {
    EXPECT_EQ(c.kind, PointKind::kCrossing);
    const Vec2 error = c.uv_px - plate.at(truth, static_cast<std::size_t>(c.feature));
    EXPECT_LT(error.norm(), 0.15) << c.feature;
    EXPECT_LT(error.dot(c.cov_px2.inverse() * error), 9.2);
  }
}

TEST_F(EdgeFinderTest, PoseFollowsTheEdges) {
  // GIVEN no corner at all but the four sides, and navigation 3 px off
  EdgeFinder finder({}, plate.model, plate.camera);
  prove(finder, truth);
  const Pose<frame::C, frame::R> T_c_r(camera_from_receiver({}), Point<frame::C>());
  Aligner aligner({}, plate.model, plate.camera, T_c_r, 0);
  RelativeState nav;
  nav.valid = true;
  const auto off = test::Plate::pose({0.2, -0.15, 0.11}, {0.27, -0.05, 9.05});
  nav.T_r_k = T_c_r.inverse() * off;
  nav.covariance = Mat6::Identity() * 0.05 * 0.05;
  ASSERT_TRUE(aligner.predict(Time{1}, &nav));
  frame(finder, truth, off);
  corners->items.clear();
  for (std::size_t i = 0; i < 6; ++i) {  // corners half a pixel off, all the same way
    Corner c;
    c.uv_px = plate.at(truth, i) + Vec2(0.5, 0.3);
    corners->items.push_back(c);
  }
  Alignment out;
  aligner.step(*aligned, *corners, out);
  ASSERT_TRUE(out.consensus);
  const double before = (plate.at(out.T_c_k, 0) - plate.at(truth, 0)).norm();
  frame(finder, truth, out.T_c_k);
  for (Edge& e : *edges) e.bias_sigma_px = 0.1;
  aligner.refine(*edges, out);
  const double after = (plate.at(out.T_c_k, 0) - plate.at(truth, 0)).norm();
  EXPECT_GT(before, 0.4);
  EXPECT_LT(after, 0.2);
}

TEST_F(EdgeFinderTest, UsesNothingBeforeItHasProvedItself) {
  EdgeFinder finder({}, plate.model, plate.camera);
  frame(finder, truth, truth);
  EXPECT_EQ(edges->size(), 4U);
  for (const Edge& e : *edges) EXPECT_FALSE(e.proven);
  finder.crossings(*edges, *corners);
  EXPECT_TRUE(corners->items.empty());
}

TEST_F(EdgeFinderTest, AnEdgeBesideTheSegmentLosesWeight) {
  // GIVEN a dark rim of 0.06 m, 2 px: the visible edge runs beside the features
  EdgeFinder finder({}, plate.model, plate.camera);
  const auto rim = [](double y, double z) { return std::max(std::fabs(y), std::fabs(z)) > 1.94 ? 60.0 : 170.0; };
  for (int n = 0; n < 60; ++n) {
    frame(finder, truth, truth, rim);
    finder.learn(alignment, *edges);
  }
  ASSERT_FALSE(edges->empty());
  for (const Edge& e : *edges) EXPECT_GT(e.bias_sigma_px, 1.3);
}

TEST_F(EdgeFinderTest, MissingRowsAndNoConsensusGiveNothingWrong) {
  EdgeFinder finder({}, plate.model, plate.camera);
  prove(finder, truth);
  auto mask = std::make_unique<RowMask>();
  for (int v = 60; v < 180; ++v) mask->set_missing(v);
  finder.find(image, mask.get(), alignment, *aligned, *edges);
  for (const Edge& e : *edges) EXPECT_TRUE(e.feature[0] + e.feature[1] == 1 || e.feature[0] + e.feature[1] == 5);  // top and bottom side at most
  alignment.consensus = false;
  finder.find(image, nullptr, alignment, *aligned, *edges);
  EXPECT_TRUE(edges->empty());
}

TEST_F(EdgeFinderTest, UsesNoHeapOnceMade) {
  EdgeFinder finder({}, plate.model, plate.camera);
  frame(finder, truth, truth);
  const test::HeapGuard guard;
  finder.find(image, nullptr, alignment, *aligned, *edges);
  finder.learn(alignment, *edges);
  finder.crossings(*edges, *corners);
  EXPECT_EQ(guard.count(), 0U);
}

}  // namespace
}  // namespace cyclops
