#include "hil/mesh_builder.hpp"

#include <cmath>
#include <map>
#include <numbers>

namespace cyclops::hil {
namespace {

constexpr double kInch_m = 0.0254, kMerge_in = 1e-7;

using Key = std::array<std::int64_t, 3>;
Key key_of(const Vec3& p) { return {std::llround(p.x() / kMerge_in), std::llround(p.y() / kMerge_in), std::llround(p.z() / kMerge_in)}; }

Vec3 weighted_normal(const Mesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.vertices_m[t.vertex[0]];
  return (mesh.vertices_m[t.vertex[1]] - a).cross(mesh.vertices_m[t.vertex[2]] - a);
}

}  // namespace

void smooth_normals(Mesh& mesh, std::size_t first, double crease_deg) {
  const double least = std::cos(crease_deg * std::numbers::pi / 180);
  std::map<std::uint32_t, std::vector<std::size_t>> about;
  std::vector<Vec3> weighted;
  for (std::size_t i = first; i < mesh.triangles.size(); ++i) {
    weighted.push_back(weighted_normal(mesh, mesh.triangles[i]));
    for (std::uint32_t v : mesh.triangles[i].vertex) about[v].push_back(i - first);
  }
  for (std::size_t i = first; i < mesh.triangles.size(); ++i) {
    Triangle& t = mesh.triangles[i];
    const Vec3 own = weighted[i - first].normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 sum = Vec3::Zero();
      for (std::size_t other : about[t.vertex[k]])
        if (weighted[other].normalized().dot(own) > least) sum += weighted[other];
      t.normal[k] = sum.norm() > 0 ? Vec3(sum.normalized()) : own;
    }
  }
}

std::uint16_t MeshBuilder::material(const Material& m) {
  mesh_.materials.push_back(m);
  return static_cast<std::uint16_t>(mesh_.materials.size() - 1);
}

void MeshBuilder::finish_part(bool closed) {
  std::map<Key, std::uint32_t> place;
  const std::size_t first = mesh_.triangles.size();
  double volume = 0;
  for (const Face& f : part_) {
    Triangle t;
    t.material = f.material;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p(f.p[k].x(), f.p[k].y() * side_, f.p[k].z());
      const auto [it, isNew] = place.emplace(key_of(p), static_cast<std::uint32_t>(mesh_.vertices_m.size()));
      if (isNew) mesh_.vertices_m.push_back(p * kInch_m);
      t.vertex[k] = it->second;
    }
    if (t.vertex[0] == t.vertex[1] || t.vertex[1] == t.vertex[2] || t.vertex[2] == t.vertex[0]) continue;
    const Vec3 centre = mesh_.vertices_m[place.begin()->second];
    volume += weighted_normal(mesh_, t).dot(mesh_.vertices_m[t.vertex[0]] - centre);
    mesh_.triangles.push_back(t);
  }
  if (closed && volume < 0)
    for (std::size_t i = first; i < mesh_.triangles.size(); ++i) std::swap(mesh_.triangles[i].vertex[1], mesh_.triangles[i].vertex[2]);
  smooth_normals(mesh_, first, crease_deg_);
  part_.clear();
}

/// A strip of triangles across the ring from its first point on, each time by the shorter diagonal: thin sections do not fold.
void MeshBuilder::cap(const Ring& ring, std::uint16_t m, bool turned) {
  const auto add = [&](std::size_t i, std::size_t j, std::size_t k) { turned ? face(ring[k], ring[j], ring[i], m) : face(ring[i], ring[j], ring[k], m); };
  std::size_t low = 0, high = ring.size() - 1;
  while (high - low >= 2) {
    const bool from_low = (ring[low + 1] - ring[high]).squaredNorm() <= (ring[low] - ring[high - 1]).squaredNorm();
    if (from_low) add(low, low + 1, high), ++low;
    else add(low, high - 1, high), --high;
  }
}

void MeshBuilder::loft(const std::vector<Ring>& rings, const CellMaterial& cell, std::uint16_t ends) {
  const std::size_t m = rings.front().size();
  for (std::size_t i = 0; i + 1 < rings.size(); ++i)
    for (std::size_t j = 0; j < m; ++j) {
      const Vec3 &a = rings[i][j], &b = rings[i][(j + 1) % m], &c = rings[i + 1][(j + 1) % m], &d = rings[i + 1][j];
      const std::uint16_t paint = cell(i, j);
      face(a, b, c, paint);
      face(a, c, d, paint);
    }
  cap(rings.front(), ends, true);
  cap(rings.back(), ends, false);
  finish_part(true);
}

void MeshBuilder::prism(const Ring& outline, const Vec3& along, std::uint16_t sides, std::uint16_t ends) {
  Ring far;
  for (const Vec3& p : outline) far.push_back(p + along);
  loft({outline, far}, [sides](auto, auto) { return sides; }, ends);
}

void MeshBuilder::box(const Vec3& l, const Vec3& h, std::uint16_t m) {
  prism({l, {h.x(), l.y(), l.z()}, {h.x(), h.y(), l.z()}, {l.x(), h.y(), l.z()}}, {0, 0, h.z() - l.z()}, m, m);
}

void MeshBuilder::lens(const Ring& outline, const Vec3& half, std::uint16_t m) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : outline) middle += p / static_cast<double>(outline.size());
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec3 &a = outline[i], &b = outline[(i + 1) % outline.size()];
    face(a, b, middle + half, m);
    face(b, a, middle - half, m);
  }
  finish_part(true);
}

void MeshBuilder::quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, std::uint16_t m) {
  face(a, b, c, m);
  face(a, c, d, m);
  finish_part(false);
}

void MeshBuilder::propeller(Propeller p) {
  p.hub_m.y() *= side_;
  p.hub_m *= kInch_m;
  p.radius_m *= kInch_m;
  p.hub_radius_m *= kInch_m;
  p.blade_chord_m *= kInch_m;
  mesh_.propellers.push_back(p);
}

}  // namespace cyclops::hil
