#include "hil/mesh_parts.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace cyclops::hil {

void merge_vertices(Mesh& mesh, double step) {
  std::map<std::array<std::int64_t, 3>, std::uint32_t> place;
  std::vector<std::uint32_t> index;
  std::vector<Vec3> kept;
  for (const Vec3& p : mesh.vertices_m) {
    const auto [it, isNew] = place.emplace(std::array<std::int64_t, 3>{std::llround(p.x() / step), std::llround(p.y() / step), std::llround(p.z() / step)}, static_cast<std::uint32_t>(kept.size()));
    if (isNew) kept.push_back(p);
    index.push_back(it->second);
  }
  mesh.vertices_m = std::move(kept);
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& v : t.vertex) v = index[v];
  const auto flat = [](const Triangle& t) { return t.vertex[0] == t.vertex[1] || t.vertex[1] == t.vertex[2] || t.vertex[2] == t.vertex[0]; };
  mesh.triangles.erase(std::remove_if(mesh.triangles.begin(), mesh.triangles.end(), flat), mesh.triangles.end());
}

std::optional<OpenEdge> find_open_edge(const Mesh& mesh) {
  struct Use { int along{0}, against{0}; std::uint16_t material{0}; };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Use> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t.vertex[k], b = t.vertex[(k + 1) % 3];
      Use& use = edges[std::minmax(a, b)];
      ++(a < b ? use.along : use.against);
      use.material = t.material;
    }
  for (const auto& [edge, use] : edges)
    if (use.along != 1 || use.against != 1) return OpenEdge{mesh.vertices_m[edge.first], mesh.vertices_m[edge.second], use.along, use.against, use.material};
  return std::nullopt;
}

void turn_outwards(Mesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices_m.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Triangle& t : mesh.triangles) {
    parent[root(t.vertex[1])] = root(t.vertex[0]);
    parent[root(t.vertex[2])] = root(t.vertex[0]);
  }
  std::map<std::uint32_t, double> volume;
  for (const Triangle& t : mesh.triangles) {
    const std::uint32_t part = root(t.vertex[0]);
    const Vec3& o = mesh.vertices_m[part];
    volume[part] += (mesh.vertices_m[t.vertex[0]] - o).dot((mesh.vertices_m[t.vertex[1]] - o).cross(mesh.vertices_m[t.vertex[2]] - o));
  }
  for (Triangle& t : mesh.triangles)
    if (volume[root(t.vertex[0])] < 0) std::swap(t.vertex[1], t.vertex[2]);
}

}  // namespace cyclops::hil
