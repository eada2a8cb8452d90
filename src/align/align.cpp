#include "align/align.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "align/anchor.hpp"
#include "align/common_error.hpp"
#include "align/pose_track.hpp"

namespace cyclops {
namespace {

using align::Anchor;
using align::CameraPose;
using align::CommonError;
using align::difference;
using align::moved;
using align::PoseTrack;
using align::Prior;
using align::projected;
using align::Problem;
using align::Reading;
using align::Seen;
using align::Vec6;

constexpr int kGrow = 14;          // features added to a reading before all are rated
constexpr int kRefine = 6;         // Gauss-Newton steps
constexpr double kSlack_px[kRefine] = {1.0, 0.7, 0.4, 0.2, 0, 0};
constexpr double kScatterWorth = 5; // residuals that the first guess of a feature's scatter is worth
constexpr double kTooFar_m = 1e4;
constexpr double kNavLead = 5;     // evidence
constexpr double kTrust_s = 0.5;   // without consensus, in which the word of the track loses weight

/// Share of the features in view that found a corner.
double support(const Alignment& a) { return static_cast<double>(a.inliers) / std::max(1.0, static_cast<double>(a.considered)); }

}  // namespace

struct Aligner::State {
  /// What a prior expects of the frame, and the best reading of the corners under it.
  struct View {
    Prior prior;
    Problem problem;
    double clutter{0};                 // corners / px^2 where it looks
    bool read{false};                  // the next two are known
    Reading best;
    double margin{0};                  // evidence over that of the next different reading
  };
  State(const AlignConfig& c, const TankerModel& m, const Camera& k, const Pose<frame::C, frame::R>& mount, double b)
      : config(c), model(m), camera(k), T_c_r(mount), boresight(b), track(config, k, body), common(config) {
    const std::size_t n = std::min(model.features().size(), kMaxFeatures);
    body.reserve(n);
    for (const Feature& f : model.features()) body.push_back(model.in_body(f));
    for (View* v : {&by_nav, &by_track}) {
      v->problem.seen.reserve(n);
      v->problem.corner.reserve(n * static_cast<std::size_t>(config.candidates));
    }
    scatter.assign(n, config.corner_sigma_px * config.corner_sigma_px);
    scatter_frames.assign(n, 0);
    residuals.reserve(n);
    supporters.reserve(n);
    readings.reserve(static_cast<std::size_t>(config.readings) + 1);
  }

  AlignConfig config;
  const TankerModel& model;
  const Camera& camera;
  Pose<frame::C, frame::R> T_c_r;
  double boresight;
  std::vector<Point<frame::K>> body;

  Prior nav;                           // of this frame
  Mat6 nav_covariance_r{Mat6::Zero()}; // of the same, receiver axes
  Prior between;                       // the same, or an earlier update carried on
  Anchor anchor;
  PoseTrack track;
  CommonError common;
  View by_nav, by_track;               // of this frame
  const View* used{nullptr};           // the one whose reading was refined
  std::vector<Reading> readings;
  struct Residual {
    std::uint16_t feature;
    double square_px2;
  };
  std::vector<Residual> residuals;     // of the last refinement
  std::vector<Vec2> supporters;        // corners that the last refinement used, each once: far away, one serves many features
  const EdgeSet* edges{nullptr};       // taken part in the refinement, or null
  std::vector<double> scatter_frames;  // by feature: how many residuals its scatter holds
  std::vector<double> scatter;         // by feature: variance of its corner about the aligned place, px^2 an axis

  [[nodiscard]] Prior prior_from(const RelativeState& state) const;
  /// A lead for the pose that features have just agreed on. Where navigation says that it cannot be, the lead is navigation's: a
  /// pattern that repeats agrees with both.
  [[nodiscard]] double track_bonus() const { return track.contradicted() ? -kNavLead : config.track_bonus * std::exp(-track.blind_s() / kTrust_s); }
  [[nodiscard]] bool agreed(const Alignment& a) const;
  void look(const Prior& prior, const PredictionSet& predicted, const CornerSet& corners, View& view) const;
  void read(double clutter, View& view);
  void refine(const View& view, const Vec6& start, Alignment& out);
  void add_edges(const CameraPose& pose, double slack_px, Mat6& H, Vec6& g) const;
  [[nodiscard]] double median_residual_px();
  void learn(const Alignment& out);
  void compare_with_navigation(Alignment& out) const;
  void place(const CameraPose& pose, const Mat6& P, double common_px, PredictionSet& predicted) const;
};

/// Navigation's pose and covariance moved into the camera, boresight added. d rotation = R e_r, d translation = R e_t;
/// a boresight rotation b moves the origin of the tanker by b x t.
Prior Aligner::State::prior_from(const RelativeState& state) const {
  Prior p;
  p.T = T_c_r * state.T_r_k;
  Mat6 A = Mat6::Zero();
  const Mat3 R = T_c_r.rotation().matrix();
  A.topLeftCorner<3, 3>() = R;
  A.bottomRightCorner<3, 3>() = R;
  Eigen::Matrix<double, 6, 3> B;
  B << Mat3::Identity(), -skew(p.T.translation().xyz);
  p.P = A * state.covariance * A.transpose() + boresight * boresight * B * B.transpose();
  p.P.diagonal().array() += 1e-14;
  p.valid = p.T.translation().xyz.allFinite() && p.P.allFinite() && p.T.translation().xyz.norm() < kTooFar_m;
  return p;
}

/// Linearises the features at the prior and collects the corners near each.
void Aligner::State::look(const Prior& prior, const PredictionSet& predicted, const CornerSet& corners, View& view) const {
  Problem& problem = view.problem;
  view.prior = prior;
  view.read = false;
  problem.seen.clear();
  problem.corner.clear();
  if (!prior.valid) return;
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
      const double w = 1 / ((1 + m / c2) * (1 + m / c2) * s.R);
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
      const double w = 1 / ((1 + m / c2) * (1 + m / c2) * variance);
      H += w * across * across.transpose();
      g += w * r * across;
    }
  }
}

bool Aligner::State::agreed(const Alignment& a) const {
  const auto needed = static_cast<std::uint32_t>(std::max(2, config.min_inliers - (a.considered < 7 ? 1 : 0)));
  return a.inliers >= needed && a.inliers >= config.min_support * a.considered && a.evidence >= config.min_evidence && a.margin >= config.min_margin;
}

void Aligner::State::compare_with_navigation(Alignment& out) const {
  if (!nav.valid) return;
  const Vec6 gap = difference(nav.T, out.T_c_k);
  out.nav_disagreement = gap.dot((nav.P + out.covariance).ldlt().solve(gap));
}

/// What this frame teaches about predicting the next one.
void Aligner::State::learn(const Alignment& out) {
  if (!out.consensus) return;
  const double n = static_cast<double>(residuals.size());
  const double lost = n > 3.5 ? n / (n - 3) : 4;  // six parameters were fitted to 2 n numbers
  for (const Residual& r : residuals) {
    double& v = scatter[r.feature];
    double& seen = scatter_frames[r.feature];
    const double gain = config.scatter_gain == 0 ? 0 : std::max(config.scatter_gain, 1 / (kScatterWorth + seen++));
    v += gain * (std::min(0.5 * r.square_px2 * lost, 9.0) - v);
    v = std::max(v, config.scatter_floor_px * config.scatter_floor_px);
  }
  track.learn(out.T_c_k, nav.valid);
  common.learn(support(out), out.residual_px);
}

Aligner::Aligner(const AlignConfig& config, const TankerModel& model, const Camera& camera, const Pose<frame::C, frame::R>& T_c_r,
                 double boresight_sigma_rad)
    : s_(std::make_unique<State>(config, model, camera, T_c_r, boresight_sigma_rad)) {}
Aligner::~Aligner() = default;

void Aligner::reset() {
  s_->scatter.assign(s_->scatter.size(), s_->config.corner_sigma_px * s_->config.corner_sigma_px);
  s_->scatter_frames.assign(s_->scatter_frames.size(), 0);
  s_->track.reset();
  s_->anchor.reset();
  s_->common.reset();
}

bool Aligner::predict(Time t_mid, const RelativeState* nav, const RelativeState* carried) {
  s_->nav = {};
  if (nav != nullptr && nav->valid) {
    s_->nav = s_->prior_from(*nav);
    s_->nav_covariance_r = nav->covariance;
  }
  s_->between = s_->nav;
  if (!s_->nav.valid && carried != nullptr) {
    s_->between = s_->prior_from(*carried);
    s_->anchor.hold(*carried, s_->T_c_r.rotation().matrix(), s_->between);
  }
  s_->track.predict(t_mid, s_->between);
  return s_->nav.valid || s_->track.prior().valid;
}

const Pose<frame::C, frame::K>& Aligner::prior_pose() const { return s_->track.prior().valid ? s_->track.prior().T : s_->nav.T; }

void Aligner::step(const PredictionSet& predicted, const CornerSet& corners, Alignment& out) {
  out = {};
  State& s = *s_;
  State::View &n = s.by_nav, &t = s.by_track;
  s.look(s.nav, predicted, corners, n);
  s.look(s.track.prior(), predicted, corners, t);
  // Both readings are weighed against the clutter that the wider prior sees: a narrow one holds little more than the features.
  const double clutter = std::min(n.prior.valid ? n.clutter : 1, t.prior.valid ? t.clutter : 1);
  s.read(clutter, n);
  s.read(clutter, t);
  const bool track_first = t.read && (!n.read || t.best.evidence + s.track_bonus() >= n.best.evidence);
  for (const bool by_track : {track_first, !track_first}) {  // the second has its chance when features do not agree on the first
    const State::View& view = by_track ? t : n;
    if (out.consensus || !view.read) continue;
    out = {};
    out.from_track = by_track;
    out.evidence = view.best.evidence;
    out.margin = view.margin;
    s.used = &view;
    s.refine(view, view.best.d, out);
    s.compare_with_navigation(out);
    out.consensus = s.agreed(out);
  }
}

void Aligner::refine(const EdgeSet& edges, Alignment& out) {
  State& s = *s_;
  if (!out.consensus || edges.empty()) return;
  s.edges = &edges;
  s.refine(*s.used, difference(s.used->prior.T, out.T_c_k), out);
  s.edges = nullptr;
  s.compare_with_navigation(out);
}

void Aligner::learn(const Alignment& alignment) {
  if (s_->nav.valid) s_->anchor.set(s_->nav.T, s_->nav_covariance_r, alignment);
  s_->learn(alignment);
  s_->track.end_frame(s_->nav);
}

double Aligner::corner_variance_px2(std::uint16_t feature) const { return s_->scatter[feature]; }

void Aligner::apply(const Alignment& alignment, PredictionSet& predicted) const {
  if (alignment.consensus) s_->place(alignment.T_c_k, alignment.covariance, alignment.common_px, predicted);
}

void Aligner::widen(PredictionSet& predicted) const {
  s_->place(prior_pose(), s_->nav.valid ? s_->nav.P : s_->track.prior().P, 0, predicted);
}

void Aligner::State::place(const CameraPose& pose, const Mat6& P, double common_px, PredictionSet& predicted) const {
  for (Prediction& p : predicted.items) {
    if (p.visibility == Visibility::kDisabled || p.visibility == Visibility::kFacingAway || p.visibility == Visibility::kHidden) continue;
    const auto at = projected(camera, pose, body[p.feature]);
    if (!at) {
      p.visibility = Visibility::kBehindCamera;
      continue;
    }
    const Mat3 survey = TankerModel::covariance_in_camera(model.features()[p.feature], pose.rotation().matrix());
    p.uv_px = at->uv;
    p.cov_px2 = at->by_pose * P * at->by_pose.transpose() + at->by_point * survey * at->by_point.transpose() + common_px * common_px * Mat2::Identity();
    p.visibility = camera.inside(at->uv) ? Visibility::kVisible : Visibility::kOutsideImage;
  }
}

}  // namespace cyclops
