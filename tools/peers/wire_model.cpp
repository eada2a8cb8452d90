#include "tools/peers/wire_model.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "hil/mesh.hpp"

namespace cyclops::peers {
namespace {

constexpr double kSharp = 30 * std::numbers::pi / 180, kShortest_m = 0.3, kPaint = 0.25;
using Side = std::pair<std::size_t, std::size_t>;

Side side(std::size_t a, std::size_t b) { return {std::min(a, b), std::max(a, b)}; }

WireModel from_mesh(const hil::Mesh& mesh, const TankerModel& tanker) {
  WireModel out;
  for (const Vec3& v : mesh.vertices_m) out.points_k.push_back(tanker.body_from_model(Point<frame::M>(v)).xyz);
  std::map<Side, std::vector<std::size_t>> faces_at;
  std::vector<Vec3> normal;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& v = mesh.triangles[f].vertex;
    const Vec3 n = (mesh.vertices_m[v[1]] - mesh.vertices_m[v[0]]).cross(mesh.vertices_m[v[2]] - mesh.vertices_m[v[0]]);
    normal.push_back(n.normalized());
    for (std::size_t i = 0; i < 3; ++i) faces_at[side(v[i], v[(i + 1) % 3])].push_back(f);
  }
  const auto is_edge = [&](const Side& s) {
    const auto& at = faces_at[s];
    if ((mesh.vertices_m[s.first] - mesh.vertices_m[s.second]).norm() < kShortest_m) return false;
    if (at.size() != 2) return true;
    const double paint = std::abs(static_cast<double>(mesh.materials[mesh.triangles[at[0]].material].albedo - mesh.materials[mesh.triangles[at[1]].material].albedo));
    return std::acos(std::clamp(normal[at[0]].dot(normal[at[1]]), -1.0, 1.0)) > kSharp || paint > kPaint;
  };
  for (const hil::Triangle& t : mesh.triangles) {
    WireModel::Face face;
    for (std::size_t i = 0; i < 3; ++i) {
      face.corner.push_back(t.vertex[i]);
      face.edge.push_back(is_edge(side(t.vertex[i], t.vertex[(i + 1) % 3])));
    }
    if (std::find(face.edge.begin(), face.edge.end(), true) != face.edge.end()) out.faces.push_back(std::move(face));
  }
  return out;
}

/// Every plane through three points with all others on one side is a face; its corners are all points of the plane.
WireModel hull(const TankerModel& tanker) {
  WireModel out;
  for (const Feature& f : tanker.features()) out.points_k.push_back(tanker.in_body(f).xyz);
  const auto& p = out.points_k;
  double size = 0;
  for (const Vec3& a : p) size = std::max(size, (a - p[0]).norm());
  std::set<std::vector<std::size_t>> seen;
  for (std::size_t i = 0; i < p.size(); ++i)
    for (std::size_t j = i + 1; j < p.size(); ++j)
      for (std::size_t k = j + 1; k < p.size(); ++k) {
        Vec3 n = (p[j] - p[i]).cross(p[k] - p[i]);
        if (n.norm() < 1e-6 * size * size) continue;
        n.normalize();
        std::vector<std::size_t> on;
        double low = 0, high = 0;
        for (std::size_t m = 0; m < p.size(); ++m) {
          const double d = n.dot(p[m] - p[i]);
          if (std::abs(d) < 1e-4 * size) on.push_back(m);
          low = std::min(low, d);
          high = std::max(high, d);
        }
        if ((low < -1e-4 * size && high > 1e-4 * size) || !seen.insert(on).second) continue;
        if (high > 1e-4 * size) n = -n;
        Vec3 centre = Vec3::Zero();
        for (std::size_t m : on) centre += p[m] / static_cast<double>(on.size());
        const Vec3 x = (p[on[0]] - centre).normalized(), y = n.cross(x);
        std::sort(on.begin(), on.end(), [&](std::size_t a, std::size_t b) {
          return std::atan2(y.dot(p[a] - centre), x.dot(p[a] - centre)) < std::atan2(y.dot(p[b] - centre), x.dot(p[b] - centre));
        });
        out.faces.push_back({on, std::vector<bool>(on.size(), true)});
      }
  return out;
}

}  // namespace

WireModel wire_model(const TankerModel& tanker) {
  const auto mesh = hil::c12_mesh(tanker);
  return mesh.ok() ? from_mesh(*mesh, tanker) : hull(tanker);
}

std::string as_cao(const WireModel& model) {
  std::ostringstream o;
  o.precision(12);
  o << "V1\n" << model.points_k.size() << "\n";
  for (const Vec3& p : model.points_k) o << p.x() << " " << p.y() << " " << p.z() << "\n";
  o << "0\n0\n" << model.faces.size() << "\n";
  for (const auto& f : model.faces) {
    o << f.corner.size();
    for (std::size_t c : f.corner) o << " " << c;
    o << "\n";
  }
  o << "0\n0\n";
  return o.str();
}

}  // namespace cyclops::peers
