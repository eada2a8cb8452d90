#include "hil/raster.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops::hil {
namespace {

constexpr double kNearest_m = 0.5, kBend_px = 0.01;
constexpr int kBand = 8;        // rows of pixels done at a time: their samples stay in the cache
constexpr int kDeepest = 6;     // halvings of an edge

struct Corner {
  Vec3 c;          // camera axes, m
  ScreenVertex s;
};

class Projector {
 public:
  Projector(const Camera& camera, std::vector<ScreenTriangle>& out) : camera_(camera), out_(out) {
    const Intrinsics& k = camera.intrinsics();
    bends_ = !camera.windscreen().empty() || k.k1 != 0 || k.k2 != 0 || k.p1 != 0 || k.p2 != 0 || k.k3 != 0;
  }
  bool place(Corner& corner) const {
    if (corner.c.z() < kNearest_m) return false;
    const auto uv = camera_.project(Point<frame::C>(corner.c));
    if (!uv) return false;
    corner.s.u = uv->x();
    corner.s.v = uv->y();
    corner.s.near = 1 / corner.c.z();
    return true;
  }
  void add(const Corner& a, const Corner& b, const Corner& c, int depth) {
    Corner ab, bc, ca;
    const bool s1 = split(a, b, ab, depth), s2 = split(b, c, bc, depth), s3 = split(c, a, ca, depth);
    if (!s1 && !s2 && !s3) { out_.push_back({{a.s, b.s, c.s}}); return; }
    if (s1 && s2 && s3) {
      add(a, ab, ca, depth + 1); add(ab, b, bc, depth + 1); add(ca, bc, c, depth + 1); add(ab, bc, ca, depth + 1);
    } else if (s1 && s2) { add(ab, b, bc, depth + 1); add(a, ab, bc, depth + 1); add(a, bc, c, depth + 1); }
    else if (s2 && s3) { add(bc, c, ca, depth + 1); add(b, bc, ca, depth + 1); add(b, ca, a, depth + 1); }
    else if (s3 && s1) { add(ca, a, ab, depth + 1); add(c, ca, ab, depth + 1); add(c, ab, b, depth + 1); }
    else if (s1) { add(a, ab, c, depth + 1); add(ab, b, c, depth + 1); }
    else if (s2) { add(b, bc, a, depth + 1); add(bc, c, a, depth + 1); }
    else { add(c, ca, b, depth + 1); add(ca, a, b, depth + 1); }
  }

 private:
  /// The point half way on the image; true when the straight edge would miss it. Symmetric in a and b: no cracks.
  bool split(const Corner& a, const Corner& b, Corner& middle, int depth) const {
    if (!bends_ || depth >= kDeepest) return false;
    const double t = a.c.z() / (a.c.z() + b.c.z());  // ideal image midpoint in space
    middle.c = (1 - t) * a.c + t * b.c;
    middle.s.counts = 0.5F * (a.s.counts + b.s.counts);
    if (!place(middle)) return false;
    return std::hypot(middle.s.u - 0.5 * (a.s.u + b.s.u), middle.s.v - 0.5 * (a.s.v + b.s.v)) > kBend_px;
  }
  const Camera& camera_;
  std::vector<ScreenTriangle>& out_;
  bool bends_{false};
};

float shade(const Vec3& normal_n, float albedo, const Light& light) {
  const double up = -normal_n.z();
  const double ambient = 0.5 * (light.sky * (1 + up) + light.ground * (1 - up));
  return albedo * static_cast<float>(ambient + light.sun * std::max(0.0, normal_n.dot(light.to_sun_n)));
}

double edge_x(const ScreenVertex& a, const ScreenVertex& b, double y) {  // the same bits for both triangles of an edge
  const bool swap = b.v < a.v || (b.v == a.v && b.u < a.u);
  const ScreenVertex &l = swap ? b : a, &h = swap ? a : b;
  return l.u + (h.u - l.u) * ((y - l.v) / (h.v - l.v));
}

struct Plane {  // a value that is linear on the image
  double a, du, dv;
  Plane(const ScreenTriangle& t, double area, double f0, double f1, double f2) {
    const ScreenVertex &p = t.p[0], &q = t.p[1], &r = t.p[2];
    du = ((f1 - f0) * (r.v - p.v) - (f2 - f0) * (q.v - p.v)) / area;
    dv = ((f2 - f0) * (q.u - p.u) - (f1 - f0) * (r.u - p.u)) / area;
    a = f0 - du * p.u - dv * p.v;
  }
};

double area_of(const ScreenTriangle& t) {
  return (t.p[1].u - t.p[0].u) * (t.p[2].v - t.p[0].v) - (t.p[2].u - t.p[0].u) * (t.p[1].v - t.p[0].v);
}

/// Samples of one band of rows.
struct Band {
  int width, columns, rows, first_row;
  std::vector<float> near, counts;
  Band(int w, int c, int r) : width(w), columns(c), rows(r), first_row(0), near(static_cast<std::size_t>(w * c * r * kBand)), counts(near.size()) {}
  [[nodiscard]] std::size_t stride() const { return static_cast<std::size_t>(width * columns); }

  void draw(const ScreenTriangle& t) {
    const double area = area_of(t);
    if (std::fabs(area) < 1e-12) return;
    const Plane near_p(t, area, t.p[0].near, t.p[1].near, t.p[2].near), light(t, area, t.p[0].counts, t.p[1].counts, t.p[2].counts);
    const double low = std::min({t.p[0].v, t.p[1].v, t.p[2].v}), high = std::max({t.p[0].v, t.p[1].v, t.p[2].v});
    const auto to_sample = [&](double v) { return (v - first_row + 0.5) * rows - 0.5; };
    const int from = static_cast<int>(std::clamp(std::ceil(to_sample(low)), 0.0, 1.0 * kBand * rows)), to = static_cast<int>(std::clamp(std::ceil(to_sample(high)), 0.0, 1.0 * kBand * rows));
    for (int j = from; j < to; ++j) draw_row(t, j, near_p, light);
  }

 private:
  void draw_row(const ScreenTriangle& t, int j, const Plane& near_p, const Plane& light) {
    const double v = (j + 0.5) / rows - 0.5 + first_row;
    double left = 1e30, right = -1e30;
    for (int e = 0; e < 3; ++e) {
      const ScreenVertex &a = t.p[e], &b = t.p[(e + 1) % 3];
      if ((a.v <= v) == (b.v <= v)) continue;
      const double u = edge_x(a, b, v);
      left = std::min(left, u);
      right = std::max(right, u);
    }
    if (!(right > left)) return;
    const auto to_sample = [&](double u) { return std::clamp(std::ceil((u + 0.5) * columns - 0.5), 0.0, static_cast<double>(width * columns)); };
    const int from = static_cast<int>(to_sample(left)), to = static_cast<int>(to_sample(right));
    float* n = near.data() + static_cast<std::size_t>(j) * stride();
    float* c = counts.data() + static_cast<std::size_t>(j) * stride();
    const double u0 = (from + 0.5) / columns - 0.5;
    const float n0 = static_cast<float>(near_p.a + near_p.du * u0 + near_p.dv * v), dn = static_cast<float>(near_p.du / columns);
    const float c0 = static_cast<float>(light.a + light.du * u0 + light.dv * v), dc = static_cast<float>(light.du / columns);
    for (int i = from; i < to; ++i) {
      const float k = static_cast<float>(i - from), z = n0 + dn * k;
      const bool nearer = z > n[i];
      n[i] = nearer ? z : n[i];
      c[i] = nearer ? c0 + dc * k : c[i];
    }
  }
};

void resolve(const Band& band, int pixel_row, std::size_t first, std::size_t last, int width, std::vector<float>& image) {
  const std::size_t columns = static_cast<std::size_t>(band.columns);
  const float each = 1.0F / static_cast<float>(band.columns * band.rows);
  float* out = image.data() + static_cast<std::size_t>(pixel_row) * static_cast<std::size_t>(width);
  for (std::size_t u = first; u < last; ++u) {
    float sum = 0;
    int covered = 0;
    for (int r = 0; r < band.rows; ++r) {
      const std::size_t at = static_cast<std::size_t>((pixel_row - band.first_row) * band.rows + r) * band.stride() + u * columns;
      for (std::size_t k = at; k < at + columns; ++k)
        if (band.near[k] > 0) { sum += band.counts[k]; ++covered; }
    }
    out[u] = sum * each + out[u] * (1 - static_cast<float>(covered) * each);
  }
}

}  // namespace

std::vector<ScreenTriangle> project_mesh(const Mesh& mesh, const Camera& camera, const Pose<frame::C, frame::M>& T_c_m, const Mat3& R_n_m, const Light& light) {
  std::vector<ScreenTriangle> out;
  out.reserve(mesh.triangles.size());
  Projector projector(camera, out);
  const Mat3 R = T_c_m.rotation().matrix();
  std::vector<Corner> corners(mesh.vertices_m.size());
  std::vector<char> ok(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i].c = R * mesh.vertices_m[i] + T_c_m.translation().xyz;
    ok[i] = projector.place(corners[i]);
  }
  for (const Triangle& t : mesh.triangles) {
    if (!ok[t.vertex[0]] || !ok[t.vertex[1]] || !ok[t.vertex[2]]) continue;
    Corner p[3] = {corners[t.vertex[0]], corners[t.vertex[1]], corners[t.vertex[2]]};
    const Vec3 flat = (mesh.vertices_m[t.vertex[1]] - mesh.vertices_m[t.vertex[0]]).cross(mesh.vertices_m[t.vertex[2]] - mesh.vertices_m[t.vertex[0]]);
    const double side = (R * flat).dot(p[0].c) > 0 ? -1 : 1;  // the side that is seen
    for (int i = 0; i < 3; ++i) p[i].s.counts = shade(side * (R_n_m * t.normal[static_cast<std::size_t>(i)]), mesh.materials[t.material].albedo, light);
    projector.add(p[0], p[1], p[2], 0);
  }
  return out;
}

bool is_free(const std::vector<ScreenTriangle>& triangles, const Vec2& px, double depth_m, double margin_m) {
  for (const ScreenTriangle& t : triangles) {
    if (std::max({t.p[0].v, t.p[1].v, t.p[2].v}) < px.y() || std::min({t.p[0].v, t.p[1].v, t.p[2].v}) > px.y()) continue;
    if (std::max({t.p[0].u, t.p[1].u, t.p[2].u}) < px.x() || std::min({t.p[0].u, t.p[1].u, t.p[2].u}) > px.x()) continue;
    const double area = area_of(t);
    if (std::fabs(area) < 1e-9) continue;
    double w[3];
    for (int i = 0; i < 3; ++i) {
      const ScreenVertex &a = t.p[(i + 1) % 3], &b = t.p[(i + 2) % 3];
      w[i] = ((b.u - a.u) * (px.y() - a.v) - (px.x() - a.u) * (b.v - a.v)) / area;
    }
    if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
    const double near = w[0] * t.p[0].near + w[1] * t.p[1].near + w[2] * t.p[2].near;
    if (1 / near < depth_m - margin_m) return false;
  }
  return true;
}

void rasterise(const std::vector<ScreenTriangle>& triangles, int width, int height, int columns, int rows, std::vector<float>& image) {
  double low = 1e9, high = -1e9, left = 1e9, right = -1e9;
  std::vector<std::vector<std::uint32_t>> bins(static_cast<std::size_t>((height + kBand - 1) / kBand));
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& p = triangles[i].p;
    const double v0 = std::min({p[0].v, p[1].v, p[2].v}), v1 = std::max({p[0].v, p[1].v, p[2].v});
    low = std::min(low, v0);
    high = std::max(high, v1);
    left = std::min({left, p[0].u, p[1].u, p[2].u});
    right = std::max({right, p[0].u, p[1].u, p[2].u});
    const int last = static_cast<int>(bins.size()) - 1;
    if (v1 < -0.5 || v0 > height) continue;
    const int a = static_cast<int>(std::clamp((v0 + 0.5) / kBand, 0.0, 1.0 * last)), b = static_cast<int>(std::clamp((v1 + 0.5) / kBand, 0.0, 1.0 * last));
    for (int k = a; k <= b; ++k) bins[static_cast<std::size_t>(k)].push_back(static_cast<std::uint32_t>(i));
  }
  const auto first = static_cast<std::size_t>(std::clamp(left - 1, 0.0, 1.0 * width)), last = static_cast<std::size_t>(std::clamp(right + 2, 0.0, 1.0 * width));
  Band band(width, columns, rows);
  for (std::size_t k = 0; k < bins.size(); ++k) {
    if (bins[k].empty()) continue;
    band.first_row = static_cast<int>(k) * kBand;
    std::fill(band.near.begin(), band.near.end(), 0.0F);
    for (std::uint32_t i : bins[k]) band.draw(triangles[i]);
    for (int v = band.first_row; v < std::min(height, band.first_row + kBand); ++v) resolve(band, v, first, last, width, image);
  }
}

}  // namespace cyclops::hil
