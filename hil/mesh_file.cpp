#include "hil/mesh_file.hpp"

#include <algorithm>
#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>

#include "hil/mesh_builder.hpp"
#include "hil/mesh_parts.hpp"

namespace cyclops::hil {
namespace {

constexpr std::uintmax_t kMostBytes = 512U << 20;
constexpr double kFarthest_m = 10'000;
const std::vector<std::string> kKinds{".obj", ".gltf", ".glb", ".stl", ".ply"};
const std::vector<std::string> kWays{"aft", "forward", "right", "left", "up", "down"};

Result<> check_file(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return make_error(ErrorCode::kNotFound, path, "is not a file");
  std::string kind = std::filesystem::path(path).extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  if (std::find(kKinds.begin(), kKinds.end(), kind) == kKinds.end()) return make_error(ErrorCode::kUnsupported, path, "is of the kind \"" + kind + "\", expected .obj, .gltf, .glb, .stl or .ply");
  if (std::filesystem::file_size(path, none) > kMostBytes) return make_error(ErrorCode::kFull, path, "is larger than 512 MB");
  return Ok{};
}

/// Columns are the file's axes in model axes. Empty when they do not span space.
Result<Mat3> axes_of(const std::string& path, const std::array<std::string, 3>& axes) {
  const Vec3 way[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  Mat3 out = Mat3::Zero();
  for (int a = 0; a < 3; ++a) {
    const auto it = std::find(kWays.begin(), kWays.end(), axes[static_cast<std::size_t>(a)]);
    if (it != kWays.end()) out.col(a) = way[it - kWays.begin()];
  }
  if (std::fabs(out.determinant()) < 0.5)
    return make_error(ErrorCode::kInvalid, path, "axes are \"" + axes[0] + "\", \"" + axes[1] + "\", \"" + axes[2] + "\", expected one of aft/forward, one of right/left and one of up/down");
  return out;
}

float luminance(const aiMaterial& m, const char* key, unsigned type, unsigned index, float otherwise) {
  aiColor3D c;
  if (m.Get(key, type, index, c) != AI_SUCCESS) return otherwise;
  const float y = 0.2126F * c.r + 0.7152F * c.g + 0.0722F * c.b;  // ITU-R BT.709
  return std::isfinite(y) ? std::clamp(y, 0.0F, 1.0F) : otherwise;
}

Material material_of(const aiMaterial& m) {
  aiString name;
  m.Get(AI_MATKEY_NAME, name);
  return {name.C_Str(), luminance(m, AI_MATKEY_COLOR_DIFFUSE, 0.5F), luminance(m, AI_MATKEY_COLOR_SPECULAR, 0), true};
}

Result<Mesh> mesh_of(const aiScene& scene, const std::string& path, double unit, const Mat3& axes) {
  Mesh out;
  for (unsigned i = 0; i < scene.mNumMaterials; ++i) out.materials.push_back(material_of(*scene.mMaterials[i]));
  if (out.materials.empty()) out.materials.emplace_back();
  if (out.materials.size() > 65535) return make_error(ErrorCode::kFull, path, "more than 65535 materials");
  const bool mirrored = axes.determinant() < 0;
  for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
    const aiMesh& part = *scene.mMeshes[i];
    const auto first = static_cast<std::uint32_t>(out.vertices_m.size());
    for (unsigned k = 0; k < part.mNumVertices; ++k) {
      const Vec3 p = unit * (axes * Vec3(part.mVertices[k].x, part.mVertices[k].y, part.mVertices[k].z));
      if (!(p.norm() < kFarthest_m)) return make_error(ErrorCode::kCorrupt, path, "part \"" + std::string(part.mName.C_Str()) + "\", vertex " + std::to_string(k) + " is not finite or beyond 10 km");
      out.vertices_m.push_back(p);
    }
    for (unsigned k = 0; k < part.mNumFaces; ++k) {
      const aiFace& f = part.mFaces[k];
      if (f.mNumIndices != 3) continue;
      Triangle t;
      t.material = static_cast<std::uint16_t>(std::min<std::size_t>(part.mMaterialIndex, out.materials.size() - 1));
      for (unsigned c = 0; c < 3; ++c) {
        if (f.mIndices[c] >= part.mNumVertices) return make_error(ErrorCode::kCorrupt, path, "a face asks for vertex " + std::to_string(f.mIndices[c]) + " of " + std::to_string(part.mNumVertices));
        t.vertex[c] = first + f.mIndices[c];
      }
      if (mirrored) std::swap(t.vertex[1], t.vertex[2]);
      out.triangles.push_back(t);
    }
  }
  return out;
}

std::string inches(const Vec3& p_m) {
  char text[96];
  std::snprintf(text, sizeof text, "x %.3f y %.3f z %.3f in", p_m.x() / 0.0254, p_m.y() / 0.0254, p_m.z() / 0.0254);
  return text;
}

}  // namespace

Result<Mesh> load_mesh(const std::string& path, const MeshFileConfig& config) {
  CYCLOPS_TRY(check_file(path));
  const auto axes = axes_of(path, config.axes);
  if (!axes.ok()) return axes.error();
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices);
  if (scene == nullptr) return make_error(ErrorCode::kCorrupt, path, std::string("cannot be read: ") + importer.GetErrorString());
  auto mesh = mesh_of(*scene, path, config.metres_per_unit, *axes);
  if (!mesh.ok()) return mesh.error();
  merge_vertices(*mesh);
  if (mesh->triangles.empty()) return make_error(ErrorCode::kTruncated, path, "holds no triangle");
  if (!config.allow_open) {
    if (const auto edge = find_open_edge(*mesh))
      return make_error(ErrorCode::kInvalid, path, "part of material \"" + mesh->materials[edge->material].name + "\" is not closed: the edge from " + inches(edge->from_m) + " to " + inches(edge->to_m) + " has " +
                                                       std::to_string(edge->along) + " triangles on one side and " + std::to_string(edge->against) + " on the other, expected 1 and 1 (or allow_open)");
    turn_outwards(*mesh);
  }
  smooth_normals(*mesh, 0, config.crease_deg);
  return mesh;
}

Result<Mesh> tanker_mesh(const TankerMeshConfig& config, const TankerModel& model) {
  auto mesh = config.mesh == "c12" ? c12_mesh(model) : load_mesh(config.mesh, config.file);
  if (!mesh.ok()) return mesh;
  for (const Feature& f : model.features()) {
    double nearest = 1e9;
    for (const Vec3& v : mesh->vertices_m) nearest = std::min(nearest, (v - f.p_m.xyz).norm());
    if (nearest <= config.feature_tolerance_m) continue;
    char text[160];
    std::snprintf(text, sizeof text, " is %.3f in from the nearest corner of the mesh, expected %.3f in at most", nearest / 0.0254, config.feature_tolerance_m / 0.0254);
    return make_error(ErrorCode::kInvalid, config.mesh, "feature " + std::to_string(f.id) + " \"" + f.name.substr(0, 40) + "\" at " + inches(f.p_m.xyz) + text);
  }
  return mesh;
}

void TankerMeshConfig::read(ConfigTable& t, const ConfigFile& from) {
  if (t.has("mesh")) {
    t.read("mesh", mesh);
    if (mesh != "c12") mesh = from.resolve(mesh);
  }
  if (t.has("mesh_unit")) {
    int unit = 0;
    const double metres[] = {0.0254, 1, 0.001, 0.01, 0.3048};
    t.read_choice("mesh_unit", {"in", "m", "mm", "cm", "ft"}, unit);
    file.metres_per_unit = metres[unit];
  }
  std::vector<std::string> axes(file.axes.begin(), file.axes.end());
  t.read("mesh_axes", axes);
  if (axes.size() == 3) std::copy(axes.begin(), axes.end(), file.axes.begin());
  else t.fail("mesh_axes", "expected three of aft forward right left up down");
  t.read("mesh_allow_open", file.allow_open);
  t.read_in("mesh_crease_deg", 0.0, 180.0, file.crease_deg);
  double tolerance_in = feature_tolerance_m / 0.0254;
  t.read_in("mesh_feature_tolerance_in", 0.0, 100.0, tolerance_in);
  feature_tolerance_m = tolerance_in * 0.0254;
}

}  // namespace cyclops::hil
