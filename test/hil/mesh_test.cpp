// Shapes of tankers: are they closed, turned outwards, mirrored, and are the features corners of them?
#include "hil/mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "hil/mesh_builder.hpp"

namespace cyclops::hil {
namespace {

constexpr double kInch_m = 0.0254;

const TankerModel& c12() {
  static const TankerModel model = TankerModel::load("config/c12/tanker.csv", kInch_m, {190, 0, 95}).value();
  return model;
}
const Mesh& c12_shape() {
  static const Mesh mesh = c12_mesh(c12()).value();
  return mesh;
}

/// Edges that are not shared by exactly two triangles running opposite ways.
std::size_t open_edges(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> seen;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++seen[{t.vertex[k], t.vertex[(k + 1) % 3]}];
  return static_cast<std::size_t>(std::count_if(seen.begin(), seen.end(), [&](const auto& e) {
    const auto back = seen.find({e.first.second, e.first.first});
    return e.second != 1 || back == seen.end();
  }));
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) sum += mesh.vertices_m[t.vertex[0]].dot(mesh.vertices_m[t.vertex[1]].cross(mesh.vertices_m[t.vertex[2]])) / 6;
  return sum;
}

TEST(Mesh, HasEveryFeatureOfTheC12AsAVertex) {
  ASSERT_EQ(c12().features().size(), 38U);
  std::vector<char> used(c12_shape().vertices_m.size());
  for (const Triangle& t : c12_shape().triangles)
    for (std::uint32_t i : t.vertex) used[i] = 1;
  for (const Feature& f : c12().features()) {
    double nearest = 1e9;
    for (std::size_t i = 0; i < used.size(); ++i)
      if (used[i]) nearest = std::min(nearest, (c12_shape().vertices_m[i] - f.p_m.xyz).norm());
    EXPECT_LT(nearest / kInch_m, 1e-6) << "feature " << f.id;
  }
}

TEST(Mesh, OfTheC12IsClosedTurnedOutwardsAndSmall) {
  EXPECT_EQ(open_edges(c12_shape()), 0U);
  EXPECT_LT(c12_shape().triangles.size(), 50'000U);
  EXPECT_GT(volume(c12_shape()), 10) << "cubic metres; parts that overlap count twice";
  EXPECT_LT(volume(c12_shape()), 60);
  for (const Triangle& t : c12_shape().triangles) {
    const Vec3& a = c12_shape().vertices_m[t.vertex[0]];
    const Vec3 flat = (c12_shape().vertices_m[t.vertex[1]] - a).cross(c12_shape().vertices_m[t.vertex[2]] - a);
    for (const Vec3& n : t.normal) {
      EXPECT_NEAR(n.norm(), 1, 1e-9);
      EXPECT_GT(n.dot(flat), 0);
    }
    EXPECT_LT(t.material, c12_shape().materials.size());
  }
}

TEST(Mesh, OfTheC12HasItsPublishedSize) {
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (const Vec3& v : c12_shape().vertices_m) low = low.cwiseMin(v), high = high.cwiseMax(v);
  const Vec3 size = (high - low) / kInch_m;
  EXPECT_NEAR(size.x(), 525, 1);
  EXPECT_NEAR(size.y(), 654, 1.5);
  ASSERT_EQ(c12_shape().propellers.size(), 2U);
  for (const Propeller& p : c12_shape().propellers) EXPECT_NEAR(p.radius_m / kInch_m, 49.25, 1e-9);
}

/// What is asked is geometry, so that a part drawn for one side only does not go unseen: wings, nacelles, tailplane.
TEST(Mesh, OfTheC12IsMirroredButForWhatHangsUnderIt) {
  const auto key = [](const Vec3& v, double side) { return std::array<long, 3>{std::lround(v.x() * 1e6), std::lround(side * v.y() * 1e6), std::lround(v.z() * 1e6)}; };
  std::map<std::array<long, 3>, int> places;
  for (const Vec3& v : c12_shape().vertices_m) places[key(v, 1)] = 1;
  std::size_t alone = 0;
  for (const Vec3& v : c12_shape().vertices_m)
    if (places.count(key(v, -1)) == 0) {
      ++alone;
      EXPECT_LT(std::fabs(v.y()), 14.1 * kInch_m) << v.transpose() / kInch_m;
      EXPECT_LT(v.z(), 90 * kInch_m) << v.transpose() / kInch_m;
    }
  EXPECT_LT(alone, 80U);
  EXPECT_GT(alone, 10U) << "the vent is on the right only";
}

TEST(MeshBuilder, TurnsAPartOutwardsHoweverItsOutlineRuns) {
  for (double along : {2.0, -2.0}) {
    MeshBuilder b;
    const auto m = b.material({"x", 0.5F, 0, true});
    b.prism({{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {0, 1, 0}}, {0, 0, along}, m, m);
    EXPECT_EQ(open_edges(b.mesh()), 0U);
    EXPECT_NEAR(volume(b.mesh()) / std::pow(kInch_m, 3), 6, 1e-9);
  }
}

}  // namespace
}  // namespace cyclops::hil
