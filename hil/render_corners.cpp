#include "hil/render_corners.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "hil/mesh_builder.hpp"

namespace cyclops::hil {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kMostMisfit = 0.015;  // rms of the contrast
constexpr double kNarrow = 0.3;        // rad; a thinner wedge has no sharp apex

struct Polygon {
  std::array<Vec2, 12> p;
  int n{0};
};

/// What of the polygon is on the left of the line through `on` along `a`.
Polygon left_of(const Polygon& in, const Vec2& on, const Vec2& a) {
  Polygon out;
  const auto side = [&](const Vec2& q) { return a.x() * (q.y() - on.y()) - a.y() * (q.x() - on.x()); };
  for (int i = 0; i < in.n; ++i) {
    const Vec2 &p = in.p[static_cast<std::size_t>(i)], &q = in.p[static_cast<std::size_t>((i + 1) % in.n)];
    const double s = side(p), t = side(q);
    if (s >= 0) out.p[static_cast<std::size_t>(out.n++)] = p;
    if ((s >= 0) != (t >= 0)) out.p[static_cast<std::size_t>(out.n++)] = p + (q - p) * (s / (s - t));
  }
  return out;
}

double area(const Polygon& g) {
  double sum = 0;
  for (int i = 0; i < g.n; ++i) {
    const Vec2 &p = g.p[static_cast<std::size_t>(i)], &q = g.p[static_cast<std::size_t>((i + 1) % g.n)];
    sum += p.x() * q.y() - p.y() * q.x();
  }
  return 0.5 * sum;
}

/// Apex and the directions of both edges; the wedge goes counter-clockwise (v down: clockwise seen) from `from` to `to`, below pi.
struct Wedge { double x, y, from, to; };

double covered(const Wedge& w, double u, double v) {
  Polygon pixel;
  pixel.p = {Vec2(u - 0.5, v - 0.5), Vec2(u + 0.5, v - 0.5), Vec2(u + 0.5, v + 0.5), Vec2(u - 0.5, v + 0.5)};
  pixel.n = 4;
  const Vec2 apex(w.x, w.y);
  return area(left_of(left_of(pixel, apex, {std::cos(w.from), std::sin(w.from)}), apex, {-std::cos(w.to), -std::sin(w.to)}));
}

struct Window {
  std::vector<Vec2> at;
  std::vector<double> value;
};

/// Residuals after the best two levels; returns rms over the contrast.
double misfit(const Window& window, const Wedge& w, std::vector<double>& residual) {
  const auto n = static_cast<double>(window.at.size());
  std::vector<double> c(window.at.size());
  double sc = 0, scc = 0, sv = 0, scv = 0;
  for (std::size_t i = 0; i < c.size(); ++i) {
    c[i] = covered(w, window.at[i].x(), window.at[i].y());
    sc += c[i], scc += c[i] * c[i], sv += window.value[i], scv += c[i] * window.value[i];
  }
  const double d = n * scc - sc * sc;
  if (d < 1e-6) return 1e9;
  const double gain = (n * scv - sc * sv) / d, offset = (sv - gain * sc) / n;
  if (std::fabs(gain) < 0.02) return 1e9;
  residual.resize(c.size());
  double sum = 0;
  for (std::size_t i = 0; i < c.size(); ++i) residual[i] = (window.value[i] - offset - gain * c[i]) / gain, sum += residual[i] * residual[i];
  return std::sqrt(sum / n);
}

Wedge moved(const Wedge& w, int k, double by) {
  Wedge m = w;
  (k == 0 ? m.x : k == 1 ? m.y : k == 2 ? m.from : m.to) += by;
  return m;
}

double refine(const Window& window, Wedge& w) {
  std::vector<double> r, plus;
  double best = misfit(window, w, r), damping = 1e-3;
  for (int pass = 0; pass < 30 && best < 1e8; ++pass) {
    Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();
    Eigen::MatrixXd J(static_cast<Eigen::Index>(r.size()), 4);
    constexpr double kStep = 1e-4;
    for (int k = 0; k < 4; ++k) {
      if (misfit(window, moved(w, k, kStep), plus) > 1e8) return best;
      for (std::size_t i = 0; i < r.size(); ++i) J(static_cast<Eigen::Index>(i), k) = (plus[i] - r[i]) / kStep;
    }
    N = J.transpose() * J;
    g = J.transpose() * Eigen::Map<Eigen::VectorXd>(r.data(), static_cast<Eigen::Index>(r.size()));
    N.diagonal() *= 1 + damping;
    const Eigen::Vector4d step = N.ldlt().solve(-g);
    if (!step.allFinite()) break;
    const Wedge next{w.x + step[0], w.y + step[1], w.from + step[2], w.to + step[3]};
    const double now = misfit(window, next, plus);
    if (now < best) {
      const bool done = step.norm() < 1e-6;
      w = next, best = now, damping *= 0.3;
      misfit(window, w, r);
      if (done) break;
    } else {
      damping *= 8;
      if (damping > 1e6) break;
    }
  }
  return best;
}

}  // namespace

namespace {

/// The wedge that fits a window of 2 reach + 1 pixels, if one does.
std::optional<Vec2> fitted(const std::vector<float>& image, int width, int height, const Vec2& guess, int reach) {
  const int u0 = static_cast<int>(std::lround(guess.x())), v0 = static_cast<int>(std::lround(guess.y()));
  if (u0 < reach || v0 < reach || u0 >= width - reach || v0 >= height - reach) return std::nullopt;
  Window window;
  for (int v = v0 - reach; v <= v0 + reach; ++v)
    for (int u = u0 - reach; u <= u0 + reach; ++u) {
      window.at.emplace_back(u - u0, v - v0);
      window.value.push_back(image[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)]);
    }
  constexpr int kTurns = 24;
  struct Start { double misfit; Wedge wedge; };
  std::vector<Start> starts;
  std::vector<double> unused;
  for (int a = 0; a < kTurns; ++a)
    for (int b = 1; b < kTurns / 2; ++b) {
      const Wedge w{0, 0, 2 * kPi * a / kTurns, 2 * kPi * (a + b) / kTurns};
      starts.push_back({misfit(window, w, unused), w});
    }
  std::partial_sort(starts.begin(), starts.begin() + 3, starts.end(), [](const Start& x, const Start& y) { return x.misfit < y.misfit; });
  double best = 1e9;
  Wedge found{};
  for (int i = 0; i < 3; ++i) {
    Wedge w = starts[static_cast<std::size_t>(i)].wedge;
    if (const double m = refine(window, w); m < best) best = m, found = w;
  }
  const double opening = found.to - found.from;
  if (best > kMostMisfit || opening < kNarrow || opening > kPi - kNarrow || std::max(std::fabs(found.x), std::fabs(found.y)) > reach - 1) return std::nullopt;
  return Vec2(u0 + found.x, v0 + found.y);
}

}  // namespace

std::optional<Vec2> wedge_apex(const std::vector<float>& image, int width, int height, const Vec2& guess) {
  const auto wide = fitted(image, width, height, guess, 6);
  if (wide) return wide;
  const auto middle = fitted(image, width, height, guess, 4), narrow = fitted(image, width, height, guess, 3);
  if (middle && narrow && (*middle - *narrow).norm() < 0.1) return middle;  // two windows of one edge pair agree
  return std::nullopt;
}

std::vector<CornerError> feature_corners(const Intrinsics& intrinsics, const Mesh& mesh, const View& view, const TankerModel& model, int zoom) {
  Look look;
  look.sky.uniform_cdm2 = 0, look.light.uniform_cdm2 = 1;
  const Renderer renderer(Camera(intrinsics, {}), mesh, look, 1);
  std::vector<CornerError> out;
  for (const FeatureTruth& t : renderer.truth(view, model)) {
    if (!t.visible || t.doubtful) continue;
    Intrinsics near = intrinsics;  // the same rays, `zoom` pixels in place of one, around the feature
    near.width = near.height = 32;
    near.fx_px *= zoom, near.fy_px *= zoom;
    near.cx_px = 15.5 + zoom * (intrinsics.cx_px - t.raw_px.x());
    near.cy_px = 15.5 + zoom * (intrinsics.cy_px - t.raw_px.y());
    std::vector<float> paint;
    Renderer(Camera(near, {}), mesh, look, 1).draw(view, Drawing::kPaint, paint);
    if (const auto apex = wedge_apex(paint, near.width, near.height, {15.5, 15.5})) out.push_back({t.id, (*apex - Vec2(15.5, 15.5)).norm() / zoom});
  }
  return out;
}

std::vector<CornerError> board_corners(const Intrinsics& intrinsics, double range_m) {
  constexpr int kSide = 6;
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
  const Camera camera(intrinsics, {});
  const Renderer renderer(camera, b.mesh(), look, 1);
  View view;
  view.T_c_m = {Rotation<frame::C, frame::M>(), Point<frame::C>(0.01, 0.02, range_m)};
  std::vector<float> mask;
  renderer.draw(view, Drawing::kMask, mask);
  std::vector<CornerError> out;
  for (const Vec3& c : corners_m) {
    const Vec2 uv = *camera.project(view.T_c_m * Point<frame::M>(c));
    if (const auto apex = wedge_apex(mask, intrinsics.width, intrinsics.height, uv)) out.push_back({static_cast<std::int32_t>(out.size()), (*apex - uv).norm()});
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
