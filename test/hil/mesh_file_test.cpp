// A tanker's shape from a file: what is taken, what is refused and with which words.
#include "hil/mesh_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "hil/mesh_parts.hpp"
#include "test/support.hpp"

namespace cyclops::hil {
namespace {

constexpr double kInch_m = 0.0254;

const char* kTetrahedron = "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl dark\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

struct Folder {
  test::TempDir dir;
  std::string put(const std::string& name, const std::string& text) const {
    std::ofstream(dir.file(name), std::ios::binary) << text;
    return dir.file(name);
  }
};

std::string error_of(const std::string& path, const MeshFileConfig& config = {}) {
  const auto mesh = load_mesh(path, config);
  return mesh.ok() ? "no error" : mesh.error().message();
}

double volume_m3(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) sum += mesh.vertices_m[t.vertex[0]].dot(mesh.vertices_m[t.vertex[1]].cross(mesh.vertices_m[t.vertex[2]])) / 6;
  return sum;
}

TEST(MeshFile, TakesUnitsAxesAndPaint) {
  const Folder f;
  f.put("t.mtl", "newmtl dark\nKd 0.1 0.1 0.1\nKs 0.7 0.7 0.7\n");
  MeshFileConfig config;
  config.metres_per_unit = 2;
  config.axes = {"forward", "up", "right"};
  const auto mesh = load_mesh(f.put("t.obj", kTetrahedron), config);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message();
  EXPECT_EQ(mesh->triangles.size(), 4U);
  EXPECT_EQ(mesh->vertices_m.size(), 4U);
  Vec3 low = Vec3::Zero(), high = low;
  for (const Vec3& v : mesh->vertices_m) low = low.cwiseMin(v), high = high.cwiseMax(v);
  EXPECT_LT((low - Vec3(-2, 0, 0)).norm() + (high - Vec3(0, 2, 2)).norm(), 1e-12);
  EXPECT_NEAR(volume_m3(*mesh), 8.0 / 6, 1e-12) << "turned outwards";
  const Material& m = mesh->materials[mesh->triangles[0].material];
  EXPECT_EQ(m.name, "dark");
  EXPECT_NEAR(m.albedo, 0.1, 1e-6);
  EXPECT_NEAR(m.gloss, 0.7, 1e-6);
}

TEST(MeshFile, TurnsAPartThatIsInsideOut) {
  const Folder f;
  const auto mesh = load_mesh(f.put("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 1 3 4\n"), {});
  ASSERT_TRUE(mesh.ok()) << mesh.error().message();
  EXPECT_GT(volume_m3(*mesh), 0);
}

TEST(MeshFile, SaysWhichEdgeIsOpenUnlessOpenIsAllowed) {
  const Folder f;
  const std::string path = f.put("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
  EXPECT_NE(error_of(path).find("is not closed: the edge from x"), std::string::npos) << error_of(path);
  MeshFileConfig config;
  config.allow_open = true;
  EXPECT_EQ(error_of(path, config), "no error");
}

TEST(MeshFile, SaysWhatIsWrongWithAFile) {
  const Folder f;
  EXPECT_EQ(error_of(f.dir.file("none.obj")), f.dir.file("none.obj") + ": is not a file");
  EXPECT_NE(error_of(f.put("t.txt", "v 0 0 0\n")).find("is of the kind \".txt\", expected .obj"), std::string::npos);
  EXPECT_NE(error_of(f.put("noise.glb", "not a mesh at all")).find("cannot be read: "), std::string::npos);
  EXPECT_NE(error_of(f.put("points.obj", "v 0 0 0\nv 1 0 0\n")), "no error");
  EXPECT_NE(error_of(f.put("far.obj", "v 0 0 0\nv 1e9 0 0\nv 0 1 0\nf 1 2 3\n")).find("is not finite or beyond 10 km"), std::string::npos);
  MeshFileConfig config;
  config.axes = {"aft", "aft", "up"};
  EXPECT_NE(error_of(f.put("t.obj", kTetrahedron), config).find("axes are \"aft\", \"aft\", \"up\""), std::string::npos);
}

TEST(MeshFile, EveryTruncationIsAMeshOrAnError) {
  const Folder f;
  const std::string stl = [] {
    std::ostringstream o;
    o << "solid t\n";
    for (int i = 0; i < 4; ++i) o << "facet normal 0 0 1\nouter loop\nvertex 0 0 " << i << "\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    o << "endsolid t\n";
    return o.str();
  }();
  int refused = 0;
  for (const auto& [name, text] : {std::pair<std::string, std::string>{"t.obj", kTetrahedron}, {"t.stl", stl}})
    for (std::size_t n = 0; n < text.size(); n += 3) refused += error_of(f.put(name, text.substr(0, n))) != "no error";
  EXPECT_GT(refused, 50);
}

TEST(TankerMesh, OfTheHeavyTankerIsDataAlone) {
  const auto model = TankerModel::load("config/heavy/tanker.csv", kInch_m, {700, 0, 150});
  ASSERT_TRUE(model.ok()) << model.error().message();
  EXPECT_GE(model->features().size(), 20U);
  TankerMeshConfig config;
  config.mesh = "config/heavy/tanker.obj";
  config.feature_tolerance_m = 1e-3 * kInch_m;
  const auto mesh = tanker_mesh(config, *model);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message();
  EXPECT_FALSE(find_open_edge(*mesh).has_value());
  for (const Feature& f : model->features()) EXPECT_FALSE(f.normals_m.empty()) << f.id;
}

TEST(TankerMesh, OfTheC12IsClosedAndAFeatureOffTheMeshIsNamed) {
  const auto model = TankerModel::load("config/c12/tanker.csv", kInch_m, {190, 0, 95});
  ASSERT_TRUE(model.ok());
  const auto c12 = tanker_mesh({}, *model);
  ASSERT_TRUE(c12.ok()) << c12.error().message();
  EXPECT_FALSE(find_open_edge(*c12).has_value());
  TankerMeshConfig config;
  config.mesh = "config/heavy/tanker.obj";
  const auto other = tanker_mesh(config, *model);
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message().find("feature 1 \"Right Stab Outboard Gap Tip\" at x 514.760 y 110.500 z 209.606 in is "), std::string::npos) << other.error().message();
}

TEST(TankerMesh, ReadsItsKeysAndRefusesAxesThatAreNotThree) {
  const auto file = ConfigFile::parse("[tanker]\nmesh = \"x/y.obj\"\nmesh_unit = \"mm\"\nmesh_axes = [\"aft\", \"up\"]\nmesh_feature_tolerance_in = 0.5\n", "s.toml");
  ASSERT_TRUE(file.ok());
  ConfigTable t = file->root().table("tanker");
  TankerMeshConfig config;
  config.read(t, *file);
  EXPECT_DOUBLE_EQ(config.file.metres_per_unit, 0.001);
  EXPECT_NEAR(config.feature_tolerance_m, 0.0127, 1e-12);
  const auto finished = file->finish();
  ASSERT_FALSE(finished.ok());
  EXPECT_NE(finished.error().message().find("mesh_axes"), std::string::npos) << finished.error().message();
}

}  // namespace
}  // namespace cyclops::hil
