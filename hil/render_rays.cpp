// What is done for every frame: tiles, samples, light.
#include "hil/render_rays.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/noise.hpp"

namespace cyclops::hil {
namespace {

using V2 = Eigen::Vector2f;
using V3 = Eigen::Vector3f;
using M3 = Eigen::Matrix3f;

constexpr int kTile = 16, kFine = 8, kCoarse = 4, kTimes = 16;
constexpr std::uint32_t kNothing = RTC_INVALID_GEOMETRY_ID;
constexpr std::uint16_t kBackground = 0xFFFE, kMixed = 0xFFFF;
constexpr float kPi = std::numbers::pi_v<float>, kShadowLift_m = 0.003F;
constexpr float kBounce = 0.25F;  // light that hidden directions still send: the body's own
constexpr double kNearest_m = 0.3;

/// Time of each of 4 x 4 samples: a magic square, so that place and time are not correlated.
constexpr int kTimeOf[16] = {15, 2, 1, 12, 4, 9, 10, 7, 8, 5, 6, 11, 3, 14, 13, 0};

struct Instant {
  M3 R_m_c;
  V3 eye_m;
};

Instant instant_of(const Pose<frame::C, frame::M>& T_c_m) {
  const auto T_m_c = T_c_m.inverse();
  return {T_m_c.rotation().matrix().cast<float>(), T_m_c.translation().xyz.cast<float>()};
}

Pose<frame::C, frame::M> pose_at(const View& view, double share) {
  const Eigen::Quaterniond q = view.T_c_m_start.rotation().quaternion().slerp(share, view.T_c_m_end.rotation().quaternion());
  return {Rotation<frame::C, frame::M>(q), Point<frame::C>(view.T_c_m_start.translation().xyz * (1 - share) + view.T_c_m_end.translation().xyz * share)};
}

}  // namespace

struct RayScene::Frame {
  const View& view;
  const Sky& sky;
  Drawing what;
  Instant at[kTimes];
  Instant mid;
  M3 R_n_m;
  V3 to_sun_m;
  int tiles_u, tiles_v;
  std::vector<char> tile;                 // touched
  std::vector<std::int32_t> tile_at;      // first pixel of a touched tile in hits and material
  std::vector<Hit> hits;                  // 16 a pixel, pixels of a tile together
  std::vector<std::uint16_t> material;
  std::vector<char> fine;                 // per pixel of the picture
  struct Disc { const Propeller* p; double phase; int u0, v0, u1, v1; V3 up, right; float light; };
  std::vector<Disc> discs;
  [[nodiscard]] int place(int u, int v) const {
    const std::int32_t first = tile_at[static_cast<std::size_t>(v / kTile * tiles_u + u / kTile)];
    return first < 0 ? -1 : first + v % kTile * kTile + u % kTile;
  }
};

V2 RayScene::direction(float u, float v) const {
  const float x = u + 0.5F, y = v + 0.5F;
  const int i = std::clamp(static_cast<int>(x), 0, width_ - 1), j = std::clamp(static_cast<int>(y), 0, height_ - 1);
  const float a = x - static_cast<float>(i), b = y - static_cast<float>(j);
  const V2* p = &directions_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_ + 1) + static_cast<std::size_t>(i)];
  const V2* q = p + width_ + 1;
  return (p[0] * (1 - a) + p[1] * a) * (1 - b) + (q[0] * (1 - a) + q[1] * a) * b;
}

std::uint16_t RayScene::material_of(std::uint32_t triangle) const { return triangle == kNothing ? kBackground : mesh_.triangles[triangle].material; }

void RayScene::mark(Frame& f) const {
  f.tiles_u = (width_ + kTile - 1) / kTile;
  f.tiles_v = (height_ + kTile - 1) / kTile;
  f.tile.assign(static_cast<std::size_t>(f.tiles_u) * static_cast<std::size_t>(f.tiles_v), 0);
  const auto touch = [&](double u0, double v0, double u1, double v1) {
    if (u1 < -0.5 || v1 < -0.5 || u0 > width_ || v0 > height_) return;
    const auto tile = [](double x, int n) { return std::clamp(static_cast<int>((std::max(x, -0.5) + 0.5) / kTile), 0, n - 1); };
    for (int j = tile(v0, f.tiles_v); j <= tile(v1, f.tiles_v); ++j)
      for (int i = tile(u0, f.tiles_u); i <= tile(u1, f.tiles_u); ++i) f.tile[static_cast<std::size_t>(j * f.tiles_u + i)] = 1;
  };
  const Intrinsics& k = camera_.intrinsics();
  const bool bends = !camera_.windscreen().empty() || k.k1 != 0 || k.k2 != 0 || k.p1 != 0 || k.p2 != 0 || k.k3 != 0;
  const auto projected = [&](const Pose<frame::C, frame::M>& T, const V3& p, Vec2& out) {
    const Vec3 c = (T * Point<frame::M>(p.cast<double>())).xyz;
    if (c.z() < kNearest_m || std::fabs(c.x()) > 2 * c.z() || std::fabs(c.y()) > 2 * c.z()) { out = {1e9, 1e9}; return c.z() >= kNearest_m; }
    out = {k.cx_px + k.fx_px * c.x() / c.z(), k.cy_px + k.fy_px * c.y() / c.z()};
    if (bends) out = camera_.raw_from_ideal(out);
    return true;
  };
  std::vector<Vec2> at(points_.size());
  bool near = false;
  double reach = 1.5 + (look_.optics.windscreen_parallax_mm > 0 ? 8 : 0);
  for (std::size_t i = 0; i < at.size(); ++i) {
    near |= !projected(f.view.T_c_m, points_[i], at[i]);
    if (!f.view.moves || i % 64 != 0 || at[i].x() > 1e8) continue;
    for (const auto* T : {&f.view.T_c_m_start, &f.view.T_c_m_end})
      if (Vec2 q; projected(*T, points_[i], q)) reach = std::max(reach, 2 + 1.3 * (q - at[i]).norm());
  }
  if (near) std::fill(f.tile.begin(), f.tile.end(), 1);
  for (const auto& t : index_) {
    const Vec2 &a = at[t[0]], &b = at[t[1]], &c = at[t[2]];
    if (std::max({a.x(), b.x(), c.x()}) > 1e8 && std::min({a.x(), b.x(), c.x()}) > 1e8) continue;
    if (std::max({a.x(), b.x(), c.x()}) > 1e8) { std::fill(f.tile.begin(), f.tile.end(), 1); continue; }
    touch(std::min({a.x(), b.x(), c.x()}) - reach, std::min({a.y(), b.y(), c.y()}) - reach, std::max({a.x(), b.x(), c.x()}) + reach, std::max({a.y(), b.y(), c.y()}) + reach);
  }
  for (std::size_t i = 0; i < mesh_.propellers.size() && f.what == Drawing::kLight; ++i) {
    const Propeller& p = mesh_.propellers[i];
    const V3 axis = p.axis.cast<float>().normalized(), up = (std::fabs(axis.z()) > 0.9F ? V3::UnitX() : V3::UnitZ()), right = up.cross(axis).normalized();
    double u0 = 1e9, v0 = 1e9, u1 = -1e9, v1 = -1e9;
    const V3 real_up = axis.cross(right);
    for (int a = 0; a < 24; ++a) {
      Vec2 q;
      const float w = 2 * kPi * static_cast<float>(a) / 24;
      projected(f.view.T_c_m, p.hub_m.cast<float>() + static_cast<float>(1.02 * p.radius_m) * (std::cos(w) * right + std::sin(w) * real_up), q);
      u0 = std::min(u0, q.x()), u1 = std::max(u1, q.x()), v0 = std::min(v0, q.y()), v1 = std::max(v1, q.y());
    }
    if (u1 > 1e8 || u1 < 0 || v1 < 0 || u0 > width_ || v0 > height_) continue;
    touch(u0 - 2, v0 - 2, u1 + 2, v1 + 2);
    const V3 n_n = f.R_n_m * (axis.dot(f.mid.eye_m - p.hub_m.cast<float>()) > 0 ? axis : V3(-axis));  // the side that is seen
    const double toward = static_cast<double>(n_n.cast<double>().dot(f.sky.to_sun_n()));
    const double light = f.sky.irradiance(n_n.cast<double>()) + f.sky.sun_lx() * std::max(toward, 0.0);
    f.discs.push_back({&p, uniform(key(seed_, 0xB1ADE + i, f.view.frame)) * 2 * std::numbers::pi, static_cast<int>(u0) - 2, static_cast<int>(v0) - 2, static_cast<int>(u1) + 2, static_cast<int>(v1) + 2, real_up, right,
                       static_cast<float>(light) * p.albedo / kPi});
  }
  f.tile_at.assign(f.tile.size(), -1);
  int n = 0;
  for (std::size_t i = 0; i < f.tile.size(); ++i)
    if (f.tile[i]) f.tile_at[i] = n++ * kTile * kTile;
  f.fine.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
  for (const auto& s : seams_) {  // a seam may be thinner than the samples are apart
    const Vec2 &a = at[s[0]], &b = at[s[1]];
    if (a.x() > 1e8 || b.x() > 1e8) continue;
    const int steps = std::min(2 + static_cast<int>((b - a).norm() * 2), 4096);
    for (int i = 0; i <= steps; ++i) {
      const Vec2 q = a + (b - a) * i / steps;
      const int u = static_cast<int>(std::floor(q.x() + 0.5)), v = static_cast<int>(std::floor(q.y() + 0.5));
      if (u >= 0 && v >= 0 && u < width_ && v < height_) f.fine[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u)] = 1;
    }
  }
}

void RayScene::shoot(const Frame& f, int u, int v, int side, Hit* out) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(32) static constexpr int kAll[8] = {-1, -1, -1, -1, -1, -1, -1, -1};
  const float step = 1.F / static_cast<float>(side);
  const V2* p = &directions_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_ + 1) + static_cast<std::size_t>(u)];
  const V2* q = p + width_ + 1;
  const V3 shift = look_.optics.windscreen_parallax_mm > 0 ? V3(start({1.0 * u, 1.0 * v}).cast<float>()) : V3(V3::Zero());
  for (int first = 0; first < side * side; first += 8) {
    RTCRayHit8 r;
    for (int k = 0; k < 8; ++k) {
      const int i = (first + k) % side, j = (first + k) / side;
      const float a = (static_cast<float>(i) + 0.5F) * step, b = (static_cast<float>(j) + 0.5F) * step;
      const V2 d = (p[0] * (1 - a) + p[1] * a) * (1 - b) + (q[0] * (1 - a) + q[1] * a) * b;
      const Instant& at = f.view.moves ? f.at[kTimeOf[side == kCoarse ? 4 * j + i : 4 * (j % 4) + (i % 4)]] : f.mid;
      const V3 w = at.R_m_c * V3(d.x(), d.y(), 1), o = at.eye_m + at.R_m_c * shift;
      r.ray.org_x[k] = o.x(), r.ray.org_y[k] = o.y(), r.ray.org_z[k] = o.z();
      r.ray.dir_x[k] = w.x(), r.ray.dir_y[k] = w.y(), r.ray.dir_z[k] = w.z();
      r.ray.tnear[k] = 0.05F, r.ray.tfar[k] = 1e4F, r.ray.mask[k] = 0xFFFFFFFF, r.ray.flags[k] = 0, r.ray.time[k] = 0, r.ray.id[k] = 0;
      r.hit.geomID[k] = r.hit.primID[k] = r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect8(kAll, scene_, &context, &r);
    for (int k = 0; k < 8; ++k) out[first + k] = {r.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? kNothing : r.hit.primID[k], r.hit.u[k], r.hit.v[k], r.ray.tfar[k]};
  }
}

void RayScene::shoot_all(Frame& f) const {
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const int at = f.place(u, v);
      if (at < 0) { u += kTile - 1; continue; }
      Hit* hits = &f.hits[static_cast<std::size_t>(at) * 16];
      shoot(f, u, v, kCoarse, hits);
      std::uint16_t m = material_of(hits[0].triangle);
      for (int k = 1; k < 16; ++k)
        if (material_of(hits[k].triangle) != m) m = kMixed;
      f.material[static_cast<std::size_t>(at)] = m;
    }
}

float RayScene::propellers(const Frame& f, int u, int v, int part, float t, float& light) const {
  float kept = 1;
  light = 0;
  for (const Frame::Disc& disc : f.discs) {
    if (u < disc.u0 || u > disc.u1 || v < disc.v0 || v > disc.v1) continue;
    const V2 d = direction(static_cast<float>(u) - 0.25F + 0.5F * static_cast<float>(part % 2), static_cast<float>(v) - 0.25F + 0.5F * static_cast<float>(part / 2));
    const V3 w = f.mid.R_m_c * V3(d.x(), d.y(), 1), axis = disc.p->axis.cast<float>(), hub = disc.p->hub_m.cast<float>();
    const float s = (hub - f.mid.eye_m).dot(axis) / w.dot(axis);
    if (!(s > 0) || s > t) continue;
    const V3 q = f.mid.eye_m + s * w - hub;
    const double r = static_cast<double>(q.norm()), share = r / disc.p->radius_m;
    if (share > 1 || r < disc.p->hub_radius_m) continue;
    const double apart = 2 * std::numbers::pi / disc.p->blades, swept = std::max(disc.p->rpm / 60 * 2 * std::numbers::pi * look_.sensor.exposure_us * 1e-6, 1e-3);
    const double chord = disc.p->blade_chord_m * std::min(1.0, 4 * (1 - share) + 0.35) * (0.75 + 0.5 * share * (1 - share) * 2), width = chord / r;
    double covered = 0, a = std::remainder(static_cast<double>(std::atan2(q.dot(disc.right), q.dot(disc.up))) - disc.phase, apart);
    for (int k = -2; k <= 2; ++k) covered += std::max(0.0, std::min(a + k * apart + width / 2, swept / 2) - std::max(a + k * apart - width / 2, -swept / 2));
    const auto share_of_time = static_cast<float>(std::min(covered / swept, 0.95));
    light += kept * share_of_time * disc.light;
    kept *= 1 - share_of_time;
  }
  return kept;
}

float RayScene::shade(const Frame& f, const Group& g, const V3& d) const {
  const Material& m = mesh_.materials[mesh_.triangles[g.triangle].material];
  if (f.what == Drawing::kMask) return 1;
  if (f.what == Drawing::kPaint) return m.albedo;
  if (look_.light.uniform_cdm2 >= 0) return m.albedo * static_cast<float>(look_.light.uniform_cdm2);
  const float u = g.u / g.n, v = g.v / g.n, w = 1 - u - v;
  const auto& c = corners_[g.triangle];
  const auto& i = index_[g.triangle];
  const V3 p = w * points_[i[0]] + u * points_[i[1]] + v * points_[i[2]];
  const float side = flat_[g.triangle].dot(d) > 0 ? -1.F : 1.F;
  const int s = side > 0 ? 0 : 1;
  V3 n = side * (w * c[0].normal + u * c[1].normal + v * c[2].normal);
  n.normalize();
  const float open = w * c[0].open[s] + u * c[1].open[s] + v * c[2].open[s];
  const V3 n_n = f.R_n_m * n, d_n = (f.R_n_m * d).normalized();
  const auto ambient = static_cast<float>(f.sky.irradiance(n_n.cast<double>())) * (open + (1 - open) * kBounce);
  const auto sun = static_cast<float>(f.sky.sun_lx());
  const float facing = n.dot(f.to_sun_m), flat_facing = side * flat_[g.triangle].normalized().dot(f.to_sun_m);
  bool lit = sun > 0 && facing > 0 && flat_facing > 0;
  if (lit) {
    const V3 o = p + kShadowLift_m * n + 2 * kShadowLift_m * f.to_sun_m;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray{o.x(), o.y(), o.z(), 0, f.to_sun_m.x(), f.to_sun_m.y(), f.to_sun_m.z(), 0, 1e3F, 0xFFFFFFFF, 0, 0};
    rtcOccluded1(scene_, &context, &ray);
    lit = ray.tfar >= 0;
  }
  float l = m.albedo / kPi * (ambient + (lit ? sun * facing : 0.F));
  if (m.gloss > 0) {
    const float cosine = std::clamp(-n_n.dot(d_n), 0.F, 1.F), x = 1 - cosine, fresnel = m.gloss * (0.04F + 0.96F * x * x * x * x * x);
    const V3 mirror = d_n + 2 * cosine * n_n;
    l = (1 - fresnel) * l + fresnel * open * static_cast<float>(f.sky.smooth(mirror.cast<double>().normalized()));
    if (lit) {
      const float h = std::max(0.F, mirror.dot(f.sky.to_sun_n().cast<float>()));
      if (h > 0.9F) l += std::min(fresnel * sun * 30 * std::pow(h, 180.F), 2.5F * sun / kPi);
    }
  }
  return l;
}

float RayScene::pixel(const Frame& f, int u, int v, const Hit* hits, int side, float background) const {
  const int half = side / 2;
  float sum = 0;
  for (int part = 0; part < 4; ++part) {
    Group groups[16];
    int n = 0, empty = 0;
    for (int k = 0; k < half * half; ++k) {
      const Hit& h = hits[(part / 2 * half + k / half) * side + part % 2 * half + k % half];
      if (h.triangle == kNothing) { ++empty; continue; }
      int g = 0;
      while (g < n && groups[g].triangle != h.triangle) ++g;
      if (g == n) groups[n++] = {h.triangle, 0, 0, 0, 0};
      groups[g].n += 1, groups[g].u += h.u, groups[g].v += h.v, groups[g].t += h.t;
    }
    const V2 d = direction(static_cast<float>(u) - 0.25F + 0.5F * static_cast<float>(part % 2), static_cast<float>(v) - 0.25F + 0.5F * static_cast<float>(part / 2));
    const V3 w = f.mid.R_m_c * V3(d.x(), d.y(), 1);
    float light = 0;
    for (int g = 0; g < n; ++g) {
      const float kept = f.discs.empty() ? 1 : propellers(f, u, v, part, groups[g].t / groups[g].n, light);
      sum += groups[g].n * (light + kept * shade(f, groups[g], w));
    }
    if (empty > 0) {
      const float kept = f.discs.empty() ? 1 : propellers(f, u, v, part, 1e4F, light);
      sum += static_cast<float>(empty) * (light + kept * background);
    }
  }
  return sum / static_cast<float>(side * side);
}

void RayScene::shade_all(Frame& f, std::vector<float>& image) const {
  Hit fine[kFine * kFine];
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const int at = f.place(u, v);
      if (at < 0) { u += kTile - 1; continue; }
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
      const std::uint16_t own = f.material[static_cast<std::size_t>(at)];
      bool mixes = own == kMixed, seam = f.fine[i] != 0, body = own != kBackground;
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du) {
          const int x = u + du, y = v + dv;
          if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
          const int there = f.place(x, y);
          const std::uint16_t m = there < 0 ? kBackground : f.material[static_cast<std::size_t>(there)];
          mixes |= m != own;
          body |= m != kBackground;
          seam |= f.fine[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] != 0;
        }
      if (mixes || (seam && body)) {
        shoot(f, u, v, kFine, fine);
        image[i] = pixel(f, u, v, fine, kFine, image[i]);
      } else {
        image[i] = pixel(f, u, v, &f.hits[static_cast<std::size_t>(at) * 16], kCoarse, image[i]);
      }
    }
}

void RayScene::trace(const View& view, const Sky& sky, Drawing what, std::vector<float>& image) const {
  static thread_local std::vector<Hit> hits;
  Frame f{view, sky, what, {}, instant_of(view.T_c_m), view.R_n_m.cast<float>(), (view.R_n_m.transpose() * sky.to_sun_n()).cast<float>(), 0, 0, {}, {}, std::move(hits), {}, {}, {}};
  for (int k = 0; k < kTimes && view.moves; ++k) f.at[k] = instant_of(pose_at(view, (k + 0.5) / kTimes));
  mark(f);
  std::size_t pixels = 0;
  for (const std::int32_t first : f.tile_at) pixels += first >= 0 ? kTile * kTile : 0;
  if (f.hits.size() < pixels * 16) f.hits.resize(pixels * 16);
  f.material.assign(pixels, kBackground);
  shoot_all(f);
  shade_all(f, image);
  hits = std::move(f.hits);
}

}  // namespace cyclops::hil
