#include "hil/render_corners.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "hil/junction.hpp"
#include "hil/mesh_builder.hpp"

namespace cyclops::hil {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSide_px = 32;                            // of a drawing about one feature
constexpr std::array kZooms{8, 16, 32, 64, 128, 256, 512, 1024};
constexpr double kAgree_px = 0.05;                      // camera's pixels, between a zoom and the next

/// The same body with a brightness of its own for each smooth face: an edge between two faces of one paint is then an edge of the drawing.
/// `step` of the brightness from face to face, modulo 1.
Mesh with_faces_apart(const Mesh& in, double step) {
  struct Side { std::size_t triangle; Vec3 a, b; };
  Mesh out = in;
  std::vector<std::size_t> parent(in.triangles.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::map<std::array<std::uint32_t, 2>, std::vector<Side>> sides;
  for (std::size_t i = 0; i < in.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const Triangle& t = in.triangles[i];
      const std::size_t l = (k + 1) % 3, low = t.vertex[k] < t.vertex[l] ? k : l, high = low == k ? l : k;
      std::vector<Side>& there = sides[{t.vertex[low], t.vertex[high]}];
      for (const Side& s : there)  // smooth across the edge: one normal at both of its ends
        if (in.triangles[s.triangle].material == t.material && (s.a - t.normal[low]).norm() + (s.b - t.normal[high]).norm() < 1e-6) parent[root(i)] = root(s.triangle);
      there.push_back({i, t.normal[low], t.normal[high]});
    }
  std::map<std::size_t, std::uint16_t> number;
  out.materials.clear();
  for (std::size_t i = 0; i < in.triangles.size(); ++i) {
    const auto [at, fresh] = number.try_emplace(root(i), static_cast<std::uint16_t>(out.materials.size()));
    if (fresh) out.materials.push_back({"face", static_cast<float>(0.15 + 0.8 * std::fmod(step * static_cast<double>(out.materials.size()), 1)), 0, false});
    out.triangles[i].material = at->second;
  }
  return out;
}

/// How far from the middle of a drawing about `raw_px` the junction there lies.
struct Offset { Vec2 px; double sigma_px; };
std::optional<Offset> offset_at(const Intrinsics& intrinsics, const Mesh& mesh, const View& view, const Vec2& raw_px, int zoom) {
  constexpr double kMiddle = 0.5 * (kSide_px - 1);
  Look look;
  look.sky.uniform_cdm2 = 0, look.light.uniform_cdm2 = 1;
  Intrinsics near = intrinsics;  // the same rays, `zoom` pixels in place of one
  near.width = near.height = kSide_px;
  near.fx_px *= zoom, near.fy_px *= zoom;
  near.cx_px = kMiddle + zoom * (intrinsics.cx_px - raw_px.x());
  near.cy_px = kMiddle + zoom * (intrinsics.cy_px - raw_px.y());
  std::vector<float> paint;
  Renderer(Camera(near, {}), mesh, look, 1).draw(view, Drawing::kPaint, paint);
  const auto found = fit_junction(paint, kSide_px, kSide_px, {kMiddle, kMiddle});
  if (!found) return std::nullopt;
  return Offset{(found->apex_px - Vec2(kMiddle, kMiddle)) / zoom, found->sigma_px / zoom};
}

}  // namespace

std::vector<FeatureCorner> feature_corners(const Intrinsics& intrinsics, const Mesh& mesh, const View& view, const TankerModel& model) {
  Look look;
  look.sky.uniform_cdm2 = 0, look.light.uniform_cdm2 = 1;
  const std::array drawings{mesh, with_faces_apart(mesh, 0.618034), with_faces_apart(mesh, 0.414214)};  // two: neighbours may be alike in one
  std::vector<FeatureCorner> out;
  for (const FeatureTruth& t : Renderer(Camera(intrinsics, {}), mesh, look, 1).truth(view, model)) {
    if (!t.visible || t.doubtful) continue;
    FeatureCorner corner{t.id};
    for (const Mesh& drawn : drawings) {
      std::optional<Offset> wider;
      for (const int zoom : kZooms) {
        const auto here = offset_at(intrinsics, drawn, view, t.raw_px, zoom);
        if (wider && here && (wider->px - here->px).norm() < kAgree_px) {
          corner = {t.id, wider->px.norm(), wider->sigma_px, zoom / 2, &drawn != &drawings[0]};
          break;
        }
        wider = here;
      }
      if (corner.px) break;
    }
    out.push_back(corner);
  }
  return out;
}

std::vector<BoardCorner> board_corners(const Camera& camera, double range_m, double parallax_mm) {
  constexpr int kSide = 6;
  const Intrinsics& intrinsics = camera.intrinsics();
  const double span = 0.5 * intrinsics.width / intrinsics.fx_px * range_m, half = 0.26 * span / kSide;
  MeshBuilder b;
  const std::uint16_t white = b.material({"white", 1.0F, 0, false});
  std::vector<Vec3> corners_m;
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j) {
      const Mat3 R = rotation_z(0.12 + 0.241 * (kSide * i + j)) * rotation_x(0.35 * std::sin(1.7 * i)) * rotation_y(0.5 * std::sin(2.3 * j));
      const Vec3 middle(span * (j / (kSide - 1.0) - 0.5), span * (i / (kSide - 1.0) - 0.5), 0);
      std::array<Vec3, 4> p;
      for (std::size_t k = 0; k < 4; ++k) {
        p[k] = middle + R * Vec3(k == 1 || k == 2 ? half : -half, k >= 2 ? half : -half, 0);
        corners_m.push_back(p[k]);
        p[k] /= 0.0254;
      }
      b.quad(p[0], p[1], p[2], p[3], white);
    }
  Look look;
  look.sky.uniform_cdm2 = 0, look.light.uniform_cdm2 = 1;
  look.optics.windscreen_parallax_mm = parallax_mm;
  const Renderer renderer(camera, b.mesh(), look, 1);
  View view;
  view.T_c_m = {Rotation<frame::C, frame::M>(), Point<frame::C>(0.01, 0.02, range_m)};
  std::vector<float> mask;
  renderer.draw(view, Drawing::kMask, mask);
  std::vector<BoardCorner> out;
  for (const Vec3& c : corners_m) {
    const Point<frame::C> p = view.T_c_m * Point<frame::M>(c);
    const Vec2 uv = *renderer.project(p);
    if (const auto found = fit_junction(mask, intrinsics.width, intrinsics.height, uv, 6, 2))
      out.push_back({static_cast<std::int32_t>(out.size()), (found->apex_px - uv).norm(), found->apex_px, p});
  }
  return out;
}

View level_view(double range_ft, double elevation_deg, double azimuth_deg, const Vec3& reference_in) {
  const double el = elevation_deg * kPi / 180, az = azimuth_deg * kPi / 180, tilt = 16 * kPi / 180;
  const Vec3 eye = reference_in * 0.0254 + range_ft * 0.3048 * Vec3(std::cos(el) * std::cos(az), std::cos(el) * std::sin(az), std::sin(el));
  Mat3 R_c_m;
  R_c_m << 0, 1, 0, -std::sin(tilt), 0, -std::cos(tilt), -std::cos(tilt), 0, std::sin(tilt);
  View view;
  view.T_c_m = {Rotation<frame::C, frame::M>(R_c_m), Point<frame::C>(-(R_c_m * eye))};
  view.R_n_m << -1, 0, 0, 0, 1, 0, 0, 0, -1;  // heading north
  view.R_n_c = view.R_n_m * R_c_m.transpose();
  return view;
}

}  // namespace cyclops::hil
