#include "hil/mesh.hpp"

namespace cyclops::hil {
namespace {

constexpr double kInch_m = 0.0254;

Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  const double length = n.norm();
  return length > 0 ? Vec3(n / length) : Vec3::UnitZ();
}

}  // namespace

std::uint32_t MeshBuilder::add(const Vec3& p_in) {
  mesh_.vertices_m.push_back(p_in * kInch_m);
  return static_cast<std::uint32_t>(mesh_.vertices_m.size() - 1);
}

std::uint16_t MeshBuilder::paint(double albedo) {
  const auto a = static_cast<float>(albedo);
  for (std::size_t i = 0; i < mesh_.materials.size(); ++i)
    if (mesh_.materials[i].albedo == a) return static_cast<std::uint16_t>(i);
  mesh_.materials.push_back({"paint" + std::to_string(mesh_.materials.size()), a, a > 0.5F ? 0.6F : 0.4F, true});
  return static_cast<std::uint16_t>(mesh_.materials.size() - 1);
}

void MeshBuilder::triangle(const Vec3& a, const Vec3& b, const Vec3& c, double albedo) {
  const Vec3 n = normal_of(a, b, c);
  mesh_.triangles.push_back({{add(a), add(b), add(c)}, paint(albedo), {n, n, n}});
}

void MeshBuilder::quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double albedo) {
  triangle(a, b, c, albedo);
  triangle(a, c, d, albedo);
}

void MeshBuilder::fan(const std::vector<Vec3>& corners, double albedo) {
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) triangle(corners[0], corners[i], corners[i + 1], albedo);
}

void MeshBuilder::grid(const Rows& rows, const CellAlbedo& albedo, bool smooth) {
  const std::size_t n = rows.size(), m = rows.front().size();
  std::vector<std::uint32_t> index(n * m);
  std::vector<Vec3> normal(n * m, Vec3::Zero());
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < m; ++j) index[i * m + j] = add(rows[i][j]);
  const auto corners = [&](std::size_t i, std::size_t j) { return std::array<std::size_t, 4>{i * m + j, (i + 1) * m + j, (i + 1) * m + j + 1, i * m + j + 1}; };
  const auto point = [&](std::size_t k) -> const Vec3& { return rows[k / m][k % m]; };
  for (std::size_t i = 0; i + 1 < n; ++i)
    for (std::size_t j = 0; j + 1 < m; ++j) {
      const auto c = corners(i, j);
      const Vec3 weighted = (point(c[2]) - point(c[0])).cross(point(c[3]) - point(c[1]));
      for (std::size_t k : c) normal[k] += weighted;
    }
  // A closed grid repeats its first column as its last: one normal for both.
  for (std::size_t i = 0; i < n; ++i)
    if ((rows[i].front() - rows[i].back()).norm() < 1e-9) normal[i * m] = normal[i * m + m - 1] = normal[i * m] + normal[i * m + m - 1];
  for (Vec3& v : normal) v = v.norm() > 0 ? Vec3(v.normalized()) : Vec3::UnitZ();
  for (std::size_t i = 0; i + 1 < n; ++i)
    for (std::size_t j = 0; j + 1 < m; ++j) {
      const double a = albedo(i, j);
      if (a < 0) continue;
      const auto c = corners(i, j);
      for (const auto& t : {std::array<std::size_t, 3>{c[0], c[1], c[2]}, std::array<std::size_t, 3>{c[0], c[2], c[3]}}) {
        const Vec3 flat = normal_of(point(t[0]), point(t[1]), point(t[2]));
        Triangle out{{index[t[0]], index[t[1]], index[t[2]]}, paint(a), {flat, flat, flat}};
        if (smooth) out.normal = {normal[t[0]], normal[t[1]], normal[t[2]]};
        mesh_.triangles.push_back(out);
      }
    }
}

void MeshBuilder::prism(const std::vector<Vec3>& outline, const Vec3& along, double albedo) {
  std::vector<Vec3> far;
  for (const Vec3& p : outline) far.push_back(p + along);
  fan(outline, albedo);
  fan(far, albedo);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const std::size_t k = (i + 1) % outline.size();
    quad(outline[i], outline[k], far[k], far[i], albedo);
  }
}

void MeshBuilder::box(const Vec3& l, const Vec3& h, double albedo) {
  prism({l, {h.x(), l.y(), l.z()}, {h.x(), h.y(), l.z()}, {l.x(), h.y(), l.z()}}, {0, 0, h.z() - l.z()}, albedo);
}

}  // namespace cyclops::hil
