#include "hil/flight_scene.hpp"

#include <algorithm>
#include <cstdio>

#include "hil/made_up_windscreen.hpp"
#include "hil/noise.hpp"
#include "hil/way.hpp"

namespace cyclops::hil {
namespace {

constexpr double kInch_m = 0.0254, kFoot_m = 0.3048;
constexpr double kClearance_m = 0.5;

const Mat3& model_flip() {  // model axes (aft right up) to body axes (forward right down)
  static const Mat3 flip = Vec3(-1, 1, -1).asDiagonal();
  return flip;
}

/// Source: Ericson, Real-Time Collision Detection 2005, 5.1.5: closest point on a triangle by its Voronoi regions.
double distance_to(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return ap.norm();
  if (d3 >= 0 && d4 <= d3) return bp.norm();
  if (d6 >= 0 && d5 <= d6) return cp.norm();
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - ab * (d1 / (d1 - d3))).norm();
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - ac * (d2 / (d2 - d6))).norm();
  if (va <= 0 && d4 >= d3 && d5 >= d6) return (bp - (c - b) * ((d4 - d3) / (d4 - d3 + d5 - d6))).norm();
  return std::fabs(ap.dot(ab.cross(ac).normalized()));
}

/// Does the ray from p, in a direction that meets no edge of an aircraft's symmetric mesh, leave through an odd number of skins?
bool inside(const Mesh& mesh, const Vec3& p) {
  const Vec3 ray = Vec3(0.3141, 0.5772, 0.7538).normalized();
  bool odd = false;
  for (const Triangle& t : mesh.triangles) {
    const Vec3& a = mesh.vertices_m[t.vertex[0]];
    const Vec3 e1 = mesh.vertices_m[t.vertex[1]] - a, e2 = mesh.vertices_m[t.vertex[2]] - a, h = ray.cross(e2), s = p - a;
    const double det = e1.dot(h);
    if (std::fabs(det) < 1e-15) continue;
    const double u = s.dot(h) / det;
    const Vec3 q = s.cross(e1);
    const double v = ray.dot(q) / det;
    if (u >= 0 && v >= 0 && u + v <= 1 && e2.dot(q) / det > 0) odd = !odd;
  }
  return odd;
}

/// Distance to the mesh, 0 inside; not worked out when it is beyond the mesh's box by more than the clearance.
double clearance(const Mesh& mesh, const Vec3& p) {
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (const Vec3& v : mesh.vertices_m) low = low.cwiseMin(v), high = high.cwiseMax(v);
  const double outside = (low - p).cwiseMax(p - high).cwiseMax(0.0).norm();
  if (outside > kClearance_m) return outside;
  if (inside(mesh, p)) return 0;
  double nearest = 1e9;
  for (const Triangle& t : mesh.triangles) nearest = std::min(nearest, distance_to(p, mesh.vertices_m[t.vertex[0]], mesh.vertices_m[t.vertex[1]], mesh.vertices_m[t.vertex[2]]));
  return nearest;
}

}  // namespace

FlightScene::FlightScene(const Scenario& s, TankerModel m, Camera c, Mesh body)
    : scenario(s), model(std::move(m)), camera(std::move(c)), mesh(std::move(body)), motion(s, key(static_cast<std::uint64_t>(s.seed), 2)),
      true_place{camera_from_receiver(s.mount), s.lens_in_receiver_m} {}

const Renderer& FlightScene::renderer() const {
  std::call_once(first_use_, [this] { renderer_ = std::make_unique<const Renderer>(camera, mesh, scenario.look, key(static_cast<std::uint64_t>(scenario.seed), 1)); });
  return *renderer_;
}

Result<std::unique_ptr<FlightScene>> FlightScene::load(const Scenario& s) {
  auto model = TankerModel::load(s.tanker, kInch_m, s.ins_in);
  if (!model.ok()) return model.error();
  auto mesh = tanker_mesh(s.mesh, *model);
  if (!mesh.ok()) return make_error(mesh.error().code, "scenario " + s.name + ", features of " + s.tanker, mesh.error().message());
  auto windscreen = made_up_windscreen(s.camera.width, s.camera.height, s.windscreen);
  if (!windscreen.ok()) return windscreen.error();
  std::unique_ptr<FlightScene> scene(new FlightScene(s, std::move(model).value(), Camera(s.camera, std::move(windscreen).value()), std::move(mesh).value()));
  CYCLOPS_TRY(scene->check());
  return scene;
}

Result<> FlightScene::check() const {
  bool seen = false;
  const int step = std::max(1, static_cast<int>(scenario.frame_rate_hz / 5));
  for (int i = 0; i < scenario.frames; i += step) {
    const auto T_m_r = (camera_from_model(relative(motion.receiver(mid_s(i)), motion.tanker(mid_s(i))), {Rotation<frame::C, frame::R>(Mat3::Identity()), Vec3::Zero()})).inverse();
    const Vec3 lens = scenario.lens_in_receiver_m, nose = lens + scenario.nose_from_lens_m;
    for (const auto& [what, at] : {std::pair<const char*, Vec3>{"lens", lens}, {"nose", nose}}) {
      const Vec3 p = T_m_r.rotation().rotate(at) + T_m_r.translation().xyz;
      const double free = clearance(mesh, p);
      if (free >= kClearance_m) continue;
      char text[200];
      std::snprintf(text, sizeof text, "at %.1f s (frame %d) the receiver's %s is %s the tanker, at x %.0f y %.0f z %.0f in of the model; at least %.1f m must stay free", mid_s(i) - mid_s(0), i + 1,
                    what, free <= 0 ? "inside" : "too near to", p.x() / kInch_m, p.y() / kInch_m, p.z() / kInch_m, kClearance_m);
      return make_error(ErrorCode::kInvalid, "scenario " + scenario.name, text);
    }
    if (seen) continue;
    const View v = view(i);
    for (const Feature& f : model.features())
      if (const auto uv = camera.project(v.T_c_m * f.p_m); uv && camera.inside(*uv)) seen = true;
  }
  if (!seen) return make_error(ErrorCode::kInvalid, "scenario " + scenario.name, "the camera never sees the tanker: no feature is inside the picture in any frame");
  return Ok{};
}

double FlightScene::start_s(int i) const { return kFirstFrame_s + i / scenario.frame_rate_hz / (1 + scenario.tick_drift_ppm * 1e-6); }
std::int64_t FlightScene::mid_ns(int i) const { return kServiceStart_ns + to_ns(start_s(i)) + to_ns(scenario.exposure_us * 1e-6) / 2; }

Pose<frame::C, frame::M> FlightScene::camera_from_model(const Pose<frame::R, frame::K>& T_r_k, const CameraPlace& place) const {
  const Pose<frame::C, frame::R> T_c_r(place.R_c_r, Point<frame::C>(-place.R_c_r.rotate(place.lens_in_receiver_m)));
  const Pose<frame::K, frame::M> T_k_m(Rotation<frame::K, frame::M>(model_flip()), model.body_from_model(Point<frame::M>()));
  return T_c_r * T_r_k * T_k_m;
}

View FlightScene::view(int i) const {
  const AircraftState r = motion.receiver(mid_s(i)), k = motion.tanker(mid_s(i));
  View v;
  v.T_c_m = camera_from_model(relative(r, k), true_place);
  v.R_n_c = local_from_ecef(r.position_e).R_e_n.transpose() * r.R_e_b * true_place.R_c_r.matrix().transpose();
  v.R_n_m = local_from_ecef(k.position_e).R_e_n.transpose() * k.R_e_b * model_flip();
  v.frame = static_cast<std::uint64_t>(i);
  const double half_s = 0.5e-6 * scenario.exposure_us;
  const auto at = [&](double t) { return camera_from_model(relative(motion.receiver(t), motion.tanker(t)), true_place); };
  v.moves = true;
  v.T_c_m_start = at(mid_s(i) - half_s);
  v.T_c_m_end = at(mid_s(i) + half_s);
  return v;
}

double FlightScene::range_ft(int i) const {
  const AircraftState r = motion.receiver(mid_s(i)), k = motion.tanker(mid_s(i));
  const Vec3 d = (scenario.reference_in - scenario.ins_in) * kInch_m;
  const Vec3 reference = k.position_e + k.R_e_b * Vec3(-d.x(), d.y(), -d.z());
  return (r.position_e + r.R_e_b * (scenario.lens_in_receiver_m + scenario.nose_from_lens_m) - reference).norm() / kFoot_m;
}

}  // namespace cyclops::hil
