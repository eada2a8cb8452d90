#include <algorithm>
#include <array>
#include <cmath>

#include "align/aligner_state.hpp"
#include "geometry/ellipse.hpp"

namespace cyclops {
namespace {

using align::CameraPose;
using align::moved;
using align::Prior;
using align::projected;
using align::Problem;
using align::Reading;
using align::Seen;
using align::Vec6;

constexpr int kGrow = 14;          // features added to a reading before all are rated
constexpr int kRefine = 6;         // Gauss-Newton steps
constexpr int kHold = 8;           // and where landmarks hold the pose
constexpr double kApart_px = 6;    // nearer patches show the same of the picture: one voice
constexpr double kAgrees = 9.2;    // squared Mahalanobis, 2 degrees of freedom, 99 %
constexpr double kSlack_px[kRefine] = {1.0, 0.7, 0.4, 0.2, 0, 0};

/// By so much a residual of squared Mahalanobis length m loses its weight (Geman & McClure).
double lost_weight(double m, double c2) { return (1 + m / c2) * (1 + m / c2); }

}  // namespace

/// Linearises the features at the prior and collects the corners near each.
void Aligner::State::look(const Prior& prior, const PredictionSet& predicted, const CornerSet& corners, View& view) const {
  Problem& problem = view.problem;
  view.prior = prior;
  view.read = false;
  problem.seen.clear();
  problem.corner.clear();
  if (prior.valid) view.spread_px = track.spread_px(prior.T, prior.P);
  if (view.spread_px > config.acquire_from_px) view.prior.valid = false;  // too bent to be read as a shift
  if (!view.prior.valid) return;
  problem.P = prior.P;
  double area = 0, found = 0;
  for (const Prediction& p : predicted.items) {
    if (p.visibility != Visibility::kVisible && p.visibility != Visibility::kOutsideImage) continue;
    Seen s;
    s.feature = p.feature;
    const auto at = projected(camera, prior.T, body[p.feature]);
    if (!at || !camera.inside(at->uv)) continue;
    s.uv = at->uv;
    s.R = scatter[p.feature];
    s.J = at->by_pose;
    const Mat2 S = s.J * prior.P * s.J.transpose() + s.R * Mat2::Identity();
    const Mat2 W = S.inverse();
    const double reach = std::sqrt(config.prior_gate * S.trace());
    std::array<std::pair<double, const Corner*>, 64> near;
    int n = 0;
    for (const Corner& c : corners.items) {
      const Vec2 r = c.uv_px - s.uv;
      if (std::fabs(r.x()) > reach || std::fabs(r.y()) > reach) continue;
      const double m = r.dot(W * r);
      if (m > config.prior_gate) continue;
      ++found;
      if (n == config.candidates && m >= near[static_cast<std::size_t>(n - 1)].first) continue;
      int slot = n < config.candidates ? n++ : n - 1;
      for (; slot > 0 && near[static_cast<std::size_t>(slot - 1)].first > m; --slot) near[static_cast<std::size_t>(slot)] = near[static_cast<std::size_t>(slot - 1)];
      near[static_cast<std::size_t>(slot)] = {m, &c};
    }
    area += 3.14159 * config.prior_gate * std::sqrt(S.determinant());
    s.first = static_cast<int>(problem.corner.size());
    s.count = n;
    for (int i = 0; i < n; ++i) problem.corner.push_back(near[static_cast<std::size_t>(i)].second->uv_px);
    if (problem.seen.size() < problem.seen.capacity()) problem.seen.push_back(s);
  }
  view.clutter = std::max((found + 1.0) / std::max(area, 1.0), 1e-5);
  // Features with few candidates first: they make the better hypotheses.
  const auto rank = [](const Seen& s) { return std::pair(s.count == 0 ? 1000 : s.count, s.feature); };
  std::sort(problem.seen.begin(), problem.seen.end(), [&](const Seen& a, const Seen& b) { return rank(a) < rank(b); });
}

/// `clutter`: corners a square pixel that are no features.
void Aligner::State::read(double clutter, View& view) {
  if (!view.prior.valid) return;
  Problem& problem = view.problem;
  problem.log_gain = std::log(config.detection_probability / (2 * 3.14159265358979 * clutter));
  align::one_point_readings(problem, static_cast<std::size_t>(config.features), static_cast<std::size_t>(config.readings), readings);
  if (readings.empty()) return;
  for (Reading& r : readings) align::grow(problem, static_cast<std::size_t>(config.features), kGrow, r);
  view.best = *std::max_element(readings.begin(), readings.end(), [](const Reading& a, const Reading& b) { return a.evidence < b.evidence; });
  double second = 0;
  for (const Reading& r : readings)
    if (align::separation_px(problem, r, view.best) > config.inlier_px) second = std::max(second, r.evidence);
  view.margin = view.best.evidence - second;
  view.read = true;
}

/// Iteratively reweighted Gauss-Newton from `start`, each feature bound to its nearest corner (Geman-McClure weights).
void Aligner::State::refine(const View& view, const Vec6& start, Alignment& out) {
  const Prior& prior = view.prior;
  const Problem& problem = view.problem;
  const Mat6 information = prior.P.inverse();
  Vec6 d = start;
  Mat6 H = information;
  const double c2 = config.robust_scale * config.robust_scale;
  for (int step = 0; step < kRefine; ++step) {
    const CameraPose pose = moved(prior.T, d);
    H = information;
    Vec6 g = -information * d;
    supporters.clear();
    residuals.clear();
    const double radius = step < 2 ? config.inlier_px + 1.0 : config.inlier_px;
    for (const Seen& s : problem.seen) {
      const auto at = projected(camera, pose, body[s.feature]);
      if (!at) continue;
      double least = radius * radius;
      const Vec2* z = nullptr;
      for (int i = s.first; i < s.first + s.count; ++i) {
        const Vec2& corner = problem.corner[static_cast<std::size_t>(i)];
        if (const double r2 = (corner - at->uv).squaredNorm(); r2 < least) {
          least = r2;
          z = &corner;
        }
      }
      if (z == nullptr) continue;
      if (std::find(supporters.begin(), supporters.end(), *z) == supporters.end()) supporters.push_back(*z);
      const double m = least / s.R;
      const double w = 1 / (lost_weight(m, c2) * s.R);
      residuals.push_back({s.feature, least});
      H += w * at->by_pose.transpose() * at->by_pose;
      g += w * at->by_pose.transpose() * (*z - at->uv);
    }
    if (edges != nullptr) add_edges(pose, kSlack_px[step], H, g);
    const Vec6 change = H.ldlt().solve(g);
    if (!change.allFinite()) break;
    d += change;
    if (change.norm() < 1e-10) break;
  }
  out.inliers = static_cast<std::uint32_t>(supporters.size());
  out.T_c_k = moved(prior.T, d);
  out.covariance = H.inverse();
  out.considered = static_cast<std::uint32_t>(problem.seen.size());
  out.residual_px = median_residual_px();
  out.common_px = common.sigma_px(support(out), out.residual_px);
}

double Aligner::State::median_residual_px() {
  if (residuals.empty()) return 0;
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end(), [](const Residual& a, const Residual& b) { return a.square_px2 < b.square_px2; });
  return std::sqrt(middle->square_px2);
}

/// Two places on each proven edge, known across it only. Weights as for corners, but with some slack in the first steps: edges are
/// so sharp that they would all count as outliers as long as the corners alone hold the pose.
void Aligner::State::add_edges(const CameraPose& pose, double slack_px, Mat6& H, Vec6& g) const {
  const double c2 = config.robust_scale * config.robust_scale;
  for (const Edge& edge : *edges) {
    if (!edge.proven) continue;
    const double variance = edge.sigma_px * edge.sigma_px + edge.bias_sigma_px * edge.bias_sigma_px + slack_px * slack_px;
    const Vec3 &a = body[edge.feature[0]].xyz, &b = body[edge.feature[1]].xyz;
    for (const Edge::Point& p : edge.inner) {
      const auto at = projected(camera, pose, Point<frame::K>(a + p.share * (b - a)));
      if (!at) continue;
      const Vec6 across = at->by_pose.transpose() * p.normal;
      const double r = p.normal.dot(p.uv_px - at->uv), m = r * r / variance;
      const double w = 1 / (lost_weight(m, c2) * variance);
      H += w * across * across.transpose();
      g += w * r * across;
    }
  }
}

/// Iteratively reweighted as with corners.
Prior Aligner::State::held(const LandmarkSet& landmarks, double loose, const Prior& prior) const {
  const Mat6 information = prior.P.inverse();
  const double c2 = config.robust_scale * config.robust_scale;
  Vec6 d = Vec6::Zero();
  Mat6 H = information;
  for (int step = 0; step < kHold; ++step) {
    const CameraPose pose = moved(prior.T, d);
    H = information;
    Vec6 g = -information * d;
    for (const Landmark& mark : landmarks) {
      const auto at = projected(camera, pose, body[mark.feature]);
      if (!at) continue;
      const Mat2 W = mark.cov_px2.inverse() / (loose * loose);
      const Vec2 r = mark.uv_px - at->uv;
      const double m = r.dot(W * r), w = 1 / lost_weight(m, c2);
      H += w * at->by_pose.transpose() * W * at->by_pose;
      g += w * at->by_pose.transpose() * W * r;
    }
    const Vec6 change = H.ldlt().solve(g);
    if (!change.allFinite()) break;
    d += change;
    if (change.norm() < 1e-10) break;
  }
  return {moved(prior.T, d), H.inverse(), true};
}

CameraPose Aligner::State::shifted(const CameraPose& pose, const LandmarkSet& landmarks) const {
  Mat2 J = Mat2::Zero();
  Vec2 way(0, 0);
  for (const Landmark& mark : landmarks) {
    const auto at = projected(camera, pose, body[mark.feature]);
    if (!at) continue;
    J += at->by_point.leftCols<2>();
    way += mark.uv_px - at->uv;
  }
  Vec6 d = Vec6::Zero();
  if (std::fabs(J.determinant()) > 0) d.segment<2>(3) = J.inverse() * way;
  return moved(pose, d);
}

/// How many landmarks with a 1 sigma of up to `sharp_px` agree with the pose, each far from the others, and the median of their distances.
void Aligner::State::count_agreeing(const LandmarkSet& landmarks, double sharp_px, Alignment& out) const {
  StaticVector<Vec2, kMaxFeatures> agreeing;
  StaticVector<double, kMaxFeatures> distance_px;
  for (const Landmark& mark : landmarks) {
    const auto at = camera.project(out.T_c_k * body[mark.feature]);
    if (!at || larger_sigma(mark.cov_px2) > sharp_px) continue;
    const Vec2 r = mark.uv_px - *at;
    const bool apart = std::none_of(agreeing.begin(), agreeing.end(), [&](const Vec2& other) { return (other - *at).norm() < kApart_px; });
    if (!apart || r.dot(mark.cov_px2.inverse() * r) > kAgrees) continue;
    agreeing.push_back(*at);
    distance_px.push_back(r.norm());
  }
  out.inliers = static_cast<std::uint32_t>(agreeing.size());
  if (agreeing.empty()) return;
  double* const middle = distance_px.begin() + distance_px.size() / 2;
  std::nth_element(distance_px.begin(), middle, distance_px.end());
  out.residual_px = *middle;
}

}  // namespace cyclops
