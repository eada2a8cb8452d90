#include "hil/junction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace cyclops::hil {
namespace {

constexpr double kPi = std::numbers::pi, kNone = 1e9;
constexpr double kMostMisfit = 0.02, kMostSigma_px = 0.06;
constexpr double kBend = 3;          // a straight edge must misfit by more than this factor, or there is no corner
constexpr double kThinnest = 0.05;   // rad between two rays
constexpr double kLeastStep = 0.08;  // of the contrast, between neighbouring sectors: else the ray between them is none
constexpr int kMostRays = 4, kTurns = 24;

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

/// Sector i lies between ray[i] and ray[i + 1], the last between the last ray and the first; rays ascend within one turn.
struct Shape {
  Vec2 apex{0, 0};
  std::array<double, kMostRays> ray{};
  int n{2};
  bool straight{false};  // two rays, the second opposite to the first
  [[nodiscard]] int parameters() const { return straight ? 3 : n + 2; }
  [[nodiscard]] double from(int i) const { return straight && i == 1 ? ray[0] + kPi : ray[static_cast<std::size_t>(i)]; }
  [[nodiscard]] double to(int i) const { return i + 1 < n ? from(i + 1) : from(0) + 2 * kPi; }
  double& parameter(int k) { return k < 2 ? apex[k] : ray[static_cast<std::size_t>(k - 2)]; }
  [[nodiscard]] bool ordered() const {
    for (int i = 0; i < n; ++i)
      if (to(i) - from(i) < kThinnest) return false;
    return true;
  }
};

using Shares = std::array<double, kMostRays>;

/// Share of a pixel in each sector: those below half a turn by clipping, the one that may be wider gets the rest.
Shares shares(const Shape& s, const Vec2& at) {
  Polygon pixel;
  for (const Vec2& corner : {Vec2(-0.5, -0.5), Vec2(0.5, -0.5), Vec2(0.5, 0.5), Vec2(-0.5, 0.5)}) pixel.p[static_cast<std::size_t>(pixel.n++)] = at + corner;
  Shares out{};
  double rest = 1;
  int wide = 0;
  for (int i = 1; i < s.n; ++i)
    if (s.to(i) - s.from(i) > s.to(wide) - s.from(wide)) wide = i;
  for (int i = 0; i < s.n; ++i) {
    if (i == wide) continue;
    const double a = s.from(i), b = s.to(i);
    rest -= out[static_cast<std::size_t>(i)] = area(left_of(left_of(pixel, s.apex, {std::cos(a), std::sin(a)}), s.apex, {-std::cos(b), -std::sin(b)}));
  }
  out[static_cast<std::size_t>(wide)] = rest;
  return out;
}

struct Window {
  std::vector<Vec2> at;
  std::vector<double> value;
};

struct Fit {
  double misfit{kNone}, smallest_step{0};  // of the contrast
  Eigen::VectorXd residual{};              // of the contrast
};

/// Misfit and residuals after the best levels.
Fit with_levels(const Window& w, const Shape& s) {
  Fit fit;
  if (!s.ordered()) return fit;
  const auto rows = static_cast<Eigen::Index>(w.at.size());
  Eigen::MatrixXd A(rows, s.n);
  for (Eigen::Index r = 0; r < rows; ++r) {
    const Shares c = shares(s, w.at[static_cast<std::size_t>(r)]);
    for (int i = 0; i < s.n; ++i) A(r, i) = c[static_cast<std::size_t>(i)];
  }
  const Eigen::Map<const Eigen::VectorXd> value(w.value.data(), rows);
  const Eigen::MatrixXd N = A.transpose() * A;
  if (N.diagonal().minCoeff() < 0.5) return fit;  // a sector without a pixel has no level
  const Eigen::VectorXd level = N.ldlt().solve(A.transpose() * value);
  const double contrast = level.maxCoeff() - level.minCoeff();
  if (!(contrast > 0.02)) return fit;
  fit.residual = (value - A * level) / contrast;
  fit.misfit = std::sqrt(fit.residual.squaredNorm() / static_cast<double>(rows));
  fit.smallest_step = 1;
  for (int i = 0; i < s.n; ++i) fit.smallest_step = std::min(fit.smallest_step, std::fabs(level[i] - level[(i + 1) % s.n]) / contrast);
  return fit;
}

Eigen::MatrixXd jacobian(const Window& w, const Shape& s, const Fit& at) {
  constexpr double kStep = 1e-4;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(at.residual.size(), s.parameters());
  for (int k = 0; k < s.parameters(); ++k) {
    Shape moved = s;
    moved.parameter(k) += kStep;
    if (const Fit plus = with_levels(w, moved); plus.misfit < kNone) J.col(k) = (plus.residual - at.residual) / kStep;
  }
  return J;
}

Fit refine(const Window& w, Shape& s) {
  Fit best = with_levels(w, s);
  double damping = 1e-3;
  for (int pass = 0; pass < 30 && best.misfit < kNone && damping < 1e6; ++pass) {
    const Eigen::MatrixXd J = jacobian(w, s, best);
    Eigen::MatrixXd N = J.transpose() * J;
    N.diagonal() *= 1 + damping;
    N.diagonal().array() += 1e-9;  // along a straight edge nothing changes
    const Eigen::VectorXd step = N.ldlt().solve(-J.transpose() * best.residual);
    if (!step.allFinite()) break;
    Shape next = s;
    for (int k = 0; k < s.parameters(); ++k) next.parameter(k) += step[k];
    Fit now = with_levels(w, next);
    if (now.misfit >= best.misfit) { damping *= 8; continue; }
    s = next, best = std::move(now), damping *= 0.3;
    if (step.norm() < 1e-6) break;
  }
  return best;
}

/// Starts: rays at multiples of a 24th of a turn from the middle, each pixel wholly in the sector of its centre; the best few.
std::vector<Shape> starts(const Window& w, int rays) {
  struct Sums { double n{0}, v{0}, vv{0}; };
  std::array<Sums, kTurns + 1> before{};
  for (std::size_t i = 0; i < w.at.size(); ++i) {
    if (w.at[i].squaredNorm() < 1) continue;
    const double turn = std::atan2(w.at[i].y(), w.at[i].x()) / (2 * kPi), v = w.value[i];
    Sums& bin = before[static_cast<std::size_t>(std::min(kTurns - 1, static_cast<int>((turn < 0 ? turn + 1 : turn) * kTurns))) + 1];
    bin.n += 1, bin.v += v, bin.vv += v * v;
  }
  for (std::size_t i = 1; i <= kTurns; ++i) before[i].n += before[i - 1].n, before[i].v += before[i - 1].v, before[i].vv += before[i - 1].vv;
  const auto spread = [&](int a, int b) {  // sum of squares about the mean of the bins from a to b, round the end
    const Sums &p = before[static_cast<std::size_t>(a)], &q = before[static_cast<std::size_t>(b % kTurns)];
    const double round = b >= kTurns ? 1 : 0, n = q.n - p.n + round * before[kTurns].n, v = q.v - p.v + round * before[kTurns].v;
    return q.vv - p.vv + round * before[kTurns].vv - (n > 0 ? v * v / n : 0);
  };
  struct Start { double misfit; std::array<int, kMostRays> ray; };
  std::vector<Start> all;
  std::array<int, kMostRays> ray{};
  const auto place = [&](const auto& self, int k, int first) -> void {
    if (k == rays) {
      double sum = 0;
      for (int i = 0; i < rays; ++i) sum += spread(ray[static_cast<std::size_t>(i)], i + 1 < rays ? ray[static_cast<std::size_t>(i + 1)] : ray[0] + kTurns);
      all.push_back({sum, ray});
      return;
    }
    for (int a = first; a < kTurns; ++a) ray[static_cast<std::size_t>(k)] = a, self(self, k + 1, a + 1);
  };
  place(place, 0, 0);
  constexpr std::size_t kTried = 4;
  std::partial_sort(all.begin(), all.begin() + kTried, all.end(), [](const Start& x, const Start& y) { return x.misfit < y.misfit; });
  std::vector<Shape> out(kTried);
  for (std::size_t i = 0; i < kTried; ++i) {
    out[i].n = rays;
    for (std::size_t k = 0; k < static_cast<std::size_t>(rays); ++k) out[i].ray[k] = 2 * kPi * all[i].ray[k] / kTurns;
  }
  return out;
}

double standard_error_px(const Window& w, const Shape& s, const Fit& fit) {
  const Eigen::MatrixXd J = jacobian(w, s, fit);
  const Eigen::MatrixXd cov = (J.transpose() * J).ldlt().solve(Eigen::MatrixXd::Identity(s.parameters(), s.parameters())) * fit.misfit * fit.misfit;
  const Mat2 apex = cov.topLeftCorner<2, 2>();
  const double half = 0.5 * apex.trace(), most = half + std::sqrt(std::max(0.0, half * half - apex.determinant()));
  return most >= 0 ? std::sqrt(most) : kNone;
}

/// Is the best of two rays good, and a straight edge nearly as good? Then more rays would only follow the sampling.
bool is_straight(const Window& w, Shape s, const Fit& fit) {
  s.straight = true;
  return fit.misfit < kMostMisfit && refine(w, s).misfit < kBend * fit.misfit;
}

struct Found { Shape shape; Fit fit; };
Found best_of(const Window& w, int rays) {
  Found best;
  for (Shape s : starts(w, rays)) {
    Fit fit = refine(w, s);
    if (fit.misfit < best.fit.misfit) best = {s, std::move(fit)};
    if (best.fit.misfit < 0.3 * kMostMisfit) break;
  }
  return best;
}

std::optional<Junction> accepted(const Window& w, const Found& f, int reach) {
  if (f.fit.misfit > kMostMisfit || f.fit.smallest_step < kLeastStep || f.shape.apex.cwiseAbs().maxCoeff() > reach - 1) return std::nullopt;
  const double sigma = standard_error_px(w, f.shape, f.fit);
  if (!(sigma < kMostSigma_px)) return std::nullopt;
  return Junction{f.shape.apex, f.shape.n, f.fit.misfit, sigma};
}

}  // namespace

std::optional<Junction> fit_junction(const std::vector<float>& image, int width, int height, const Vec2& guess, int reach, int most_rays) {
  const int u0 = static_cast<int>(std::lround(guess.x())), v0 = static_cast<int>(std::lround(guess.y()));
  if (u0 < reach || v0 < reach || u0 >= width - reach || v0 >= height - reach) return std::nullopt;
  Window window;
  for (int v = v0 - reach; v <= v0 + reach; ++v)
    for (int u = u0 - reach; u <= u0 + reach; ++u) {
      window.at.emplace_back(u - u0, v - v0);
      window.value.push_back(static_cast<double>(image[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)]));
    }
  for (int rays = 2; rays <= std::min(most_rays, kMostRays); ++rays) {
    const Found best = best_of(window, rays);
    if (rays == 2 && is_straight(window, best.shape, best.fit)) return std::nullopt;
    if (auto found = accepted(window, best, reach)) {
      found->apex_px += Vec2(u0, v0);
      return found;
    }
  }
  return std::nullopt;
}

}  // namespace cyclops::hil
