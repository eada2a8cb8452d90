#include "align/align.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "align/reading.hpp"

namespace cyclops {
namespace {

using align::Jac;
using align::Problem;
using align::Reading;
using align::Seen;
using align::Vec6;
using CameraPose = Pose<frame::C, frame::K>;

constexpr int kGrow = 14;          // features added to a reading before all are rated
constexpr int kRefine = 6;         // Gauss-Newton steps
constexpr double kSlack_px[kRefine] = {1.0, 0.7, 0.4, 0.2, 0, 0};
constexpr double kScatterWorth = 5; // residuals that the first guess of a feature's scatter is worth
constexpr double kDoubt = 16.8;     // 99 % of chi-square with 6 degrees of freedom: navigation and picture may contradict each other
constexpr double kTooFar_m = 1e4;

CameraPose moved(const CameraPose& T, const Vec6& d) {
  const Rotation<frame::C, frame::K> R(so3_exp(d.head<3>()) * T.rotation().quaternion());
  return {R, Point<frame::C>(T.translation().xyz + d.tail<3>())};
}

/// d with moved(a, d) = b.
Vec6 difference(const CameraPose& a, const CameraPose& b) {
  Vec6 d;
  d.head<3>() = so3_log(b.rotation().quaternion() * a.rotation().quaternion().conjugate());
  d.tail<3>() = b.translation() - a.translation();
  return d;
}

struct Prior {
  CameraPose T{};
  Mat6 P{Mat6::Identity()};
  bool valid{false};
};

}  // namespace

Result<AlignConfig> AlignConfig::read(ConfigTable& t, AlignConfig c) {
  t.read("enabled", c.enabled);
  t.read_in("corner_sigma_px", 0.05, 20.0, c.corner_sigma_px);
  t.read_in("scatter_gain", 0.0, 1.0, c.scatter_gain);
  t.read_in("scatter_floor_px", 0.01, 20.0, c.scatter_floor_px);
  t.read_in("detection_probability", 0.01, 0.999, c.detection_probability);
  t.read_in("prior_gate", 1.0, 50.0, c.prior_gate);
  t.read_in("candidates", 1, 64, c.candidates);
  t.read_in("features", 3, 64, c.features);
  t.read_in("readings", 1, 64, c.readings);
  t.read_in("min_evidence", 0.0, 1e3, c.min_evidence);
  t.read_in("min_margin", 0.0, 1e3, c.min_margin);
  t.read_in("min_inliers", 2, 64, c.min_inliers);
  t.read_in("min_support", 0.0, 1.0, c.min_support);
  t.read_in("inlier_px", 0.1, 50.0, c.inlier_px);
  t.read_in("robust_scale", 0.5, 20.0, c.robust_scale);
  t.read_in("common_px", 0.0, 10.0, c.common_px);
  t.read_in("track_floor_px", 0.1, 50.0, c.track_floor_px);
  t.read_in("track_growth_px_s", 0.0, 1e3, c.track_growth_px_s);
  t.read_in("track_bonus", 0.0, 100.0, c.track_bonus);
  t.read_in("search_sigmas", 0.0, 10.0, c.search_sigmas);
  t.read_in("search_most_px", 0.0, 1000.0, c.search_most_px);
  t.read_in("wide_every", 1, 100000, c.wide_every);
  t.read_in("forget_after_s", 0.0, 1e4, c.forget_after_s);
  return c;
}

struct Aligner::State {
  State(const AlignConfig& c, const TankerModel& m, const Camera& k, const Pose<frame::C, frame::R>& mount, double b)
      : config(c), model(m), camera(k), T_c_r(mount), boresight(b) {
    const std::size_t n = std::min(model.features().size(), kMaxFeatures);
    body.reserve(n);
    for (const Feature& f : model.features()) body.push_back(model.in_body(f));
    problem.seen.reserve(n);
    scatter.assign(n, config.corner_sigma_px * config.corner_sigma_px);
    scatter_frames.assign(n, 0);
    residuals.reserve(n);
    supporters.reserve(n);
    problem.corner.reserve(n * static_cast<std::size_t>(config.candidates));
    readings.reserve(static_cast<std::size_t>(config.readings) + 1);
  }

  AlignConfig config;
  const TankerModel& model;
  const Camera& camera;
  Pose<frame::C, frame::R> T_c_r;
  double boresight;
  std::vector<Point<frame::K>> body;

  Prior nav, track;                    // of this frame
  Prior previous_nav;                  // of the frame before
  Mat6 shape{Mat6::Zero()};            // newest covariance of navigation: the shape of what is not known
  bool has_shape{false};
  Time now{}, then{};

  bool wide{true};                     // this frame is searched as far as navigation allows
  int narrow_frames{0};
  bool consensus_before{false};
  double disagreement_before{0};
  bool locked{false};                  // there is an aligned pose of an earlier frame
  CameraPose T{};                      // that pose
  Vec6 velocity{Vec6::Zero()};         // per second
  Time t_pose{}, t_consensus{};
  double error_px{3};                  // how far predictions from it have recently been off, rms
  std::array<CameraPose, 3> ways{};    // predictions of this frame: standing still, constant velocity, navigation's motion
  std::array<double, 3> way_error_px2{{9, 9, 16}};
  bool way_nav{false};

  Problem problem;
  std::vector<Reading> readings;
  struct Residual {
    std::uint16_t feature;
    double square_px2;
  };
  std::vector<Residual> residuals;     // of the last refinement
  std::vector<Vec2> supporters;        // corners that the last refinement used, each once: far away, one serves many features
  Prior used;                          // the prior that the reading of this frame came from
  const EdgeSet* edges{nullptr};       // taken part in the refinement, or null
  std::vector<double> scatter_frames;  // by feature: how many residuals its scatter holds
  std::vector<double> scatter;         // by feature: variance of its corner about the aligned place, px^2 an axis

  [[nodiscard]] Prior prior_from(const RelativeState& state) const;
  void prior_from_track();
  void choose_width();
  [[nodiscard]] double spread_px(const CameraPose& pose, const Mat6& P) const;
  void pose_problem(const Prior& prior, const PredictionSet& predicted, const CornerSet& corners);
  bool read(const Prior& prior, const PredictionSet&, const CornerSet&, Reading& best, double& margin);
  void refine(const Prior& prior, const Vec6& start, Alignment& out);
  void add_edges(const CameraPose& pose, double slack_px, Mat6& H, Vec6& g) const;
  void learn(const Alignment& out);
  [[nodiscard]] double distance_px(const CameraPose& a, const CameraPose& b) const;
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

/// rms over a sample of the features of the 1-sigma prediction error (per axis), px.
double Aligner::State::spread_px(const CameraPose& pose, const Mat6& P) const {
  double sum = 0;
  int n = 0;
  const std::size_t step = 1 + body.size() / 16;
  for (std::size_t i = 0; i < body.size(); i += step) {
    Eigen::Matrix<double, 2, 3> J;
    const Vec3 p_c = pose.rotation().rotate(body[i].xyz);
    if (!camera.project(pose * body[i], J)) continue;
    Jac full;
    full << -J * skew(p_c), J;
    sum += 0.5 * (full * P * full.transpose()).trace();
    ++n;
  }
  return n == 0 ? 0 : std::sqrt(sum / n);
}

double Aligner::State::distance_px(const CameraPose& a, const CameraPose& b) const {
  double sum = 0;
  int n = 0;
  const std::size_t step = 1 + body.size() / 16;
  for (std::size_t i = 0; i < body.size(); i += step) {
    const auto ua = camera.project(a * body[i]), ub = camera.project(b * body[i]);
    if (!ua || !ub) continue;
    sum += (*ua - *ub).squaredNorm();
    ++n;
  }
  return n == 0 ? 0 : std::sqrt(0.5 * sum / n);
}

void Aligner::State::prior_from_track() {
  track = {};
  if (!locked || !has_shape || (now - t_consensus).seconds() > config.forget_after_s) return;
  const double dt = (now - t_pose).seconds();
  ways[0] = T;
  ways[1] = moved(T, velocity * dt);
  way_nav = nav.valid && previous_nav.valid;
  ways[2] = way_nav ? moved(T, difference(previous_nav.T, nav.T)) : ways[1];
  std::size_t best = way_error_px2[0] < way_error_px2[1] ? 0 : 1;
  if (way_nav && way_error_px2[2] < way_error_px2[best]) best = 2;
  track.T = ways[best];
  const double blind = (now - t_consensus).seconds();
  const double sigma = std::max(config.track_floor_px, error_px) + config.track_growth_px_s * std::max(0.0, blind - 0.05);
  const double scale = sigma / std::max(1e-6, spread_px(track.T, shape));
  track.P = shape * (scale * scale);
  track.valid = true;
  if (!nav.valid) return;
  const Mat6 S = track.P + nav.P;  // navigation pulls the track towards itself as far as its own covariance says
  const Vec6 gap = difference(track.T, nav.T);
  const auto solver = S.ldlt();
  if (gap.dot(solver.solve(gap)) > 40.0) return;  // they contradict each other: each stands for itself
  track.T = moved(track.T, track.P * solver.solve(gap));
  track.P = track.P - track.P * solver.solve(track.P);
  track.P = 0.5 * (track.P + track.P.transpose().eval());
}

/// While the pose of earlier frames holds and navigation does not contradict it, looking around that pose is enough.
void Aligner::State::choose_width() {
  const bool held = track.valid && consensus_before && disagreement_before < kDoubt;
  wide = !held || ++narrow_frames >= config.wide_every;
  if (wide) narrow_frames = 0;
}

/// Linearises the features at the prior and collects the corners near each.
void Aligner::State::pose_problem(const Prior& prior, const PredictionSet& predicted, const CornerSet& corners) {
  problem.seen.clear();
  problem.corner.clear();
  problem.P = prior.P;
  double area = 0, found = 0;
  for (const Prediction& p : predicted.items) {
    if (p.visibility != Visibility::kVisible && p.visibility != Visibility::kOutsideImage) continue;
    Seen s;
    s.feature = p.feature;
    Eigen::Matrix<double, 2, 3> J;
    const auto uv = camera.project(prior.T * body[p.feature], J);
    if (!uv || !camera.inside(*uv)) continue;
    s.uv = *uv;
    s.R = scatter[p.feature];
    s.J << -J * skew(prior.T.rotation().rotate(body[p.feature].xyz)), J;
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
      int at = n < config.candidates ? n++ : n - 1;
      for (; at > 0 && near[static_cast<std::size_t>(at - 1)].first > m; --at) near[static_cast<std::size_t>(at)] = near[static_cast<std::size_t>(at - 1)];
      near[static_cast<std::size_t>(at)] = {m, &c};
    }
    area += 3.14159 * config.prior_gate * std::sqrt(S.determinant());
    s.first = static_cast<int>(problem.corner.size());
    s.count = n;
    for (int i = 0; i < n; ++i) problem.corner.push_back(near[static_cast<std::size_t>(i)].second->uv_px);
    if (problem.seen.size() < problem.seen.capacity()) problem.seen.push_back(s);
  }
  const double density = std::max((found + 1.0) / std::max(area, 1.0), 1e-5);
  problem.log_gain = std::log(config.detection_probability / (2 * 3.14159265358979 * density));
  // Features with few candidates first: they make the better hypotheses.
  const auto rank = [](const Seen& s) { return std::pair(s.count == 0 ? 1000 : s.count, s.feature); };
  std::sort(problem.seen.begin(), problem.seen.end(), [&](const Seen& a, const Seen& b) { return rank(a) < rank(b); });
}

bool Aligner::State::read(const Prior& prior, const PredictionSet& predicted, const CornerSet& corners, Reading& best, double& margin) {
  pose_problem(prior, predicted, corners);
  align::one_point_readings(problem, static_cast<std::size_t>(config.features), static_cast<std::size_t>(config.readings), readings);
  if (readings.empty()) return false;
  for (Reading& r : readings) align::grow(problem, static_cast<std::size_t>(config.features), kGrow, r);
  const auto top = std::max_element(readings.begin(), readings.end(), [](const Reading& a, const Reading& b) { return a.evidence < b.evidence; });
  best = *top;
  double second = 0;
  for (const Reading& r : readings)
    if (align::separation_px(problem, r, best) > config.inlier_px) second = std::max(second, r.evidence);
  margin = best.evidence - second;
  return true;
}

/// Iteratively reweighted Gauss-Newton from `start`, each feature bound to its nearest corner (Geman-McClure weights).
void Aligner::State::refine(const Prior& prior, const Vec6& start, Alignment& out) {
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
      Eigen::Matrix<double, 2, 3> J;
      const auto uv = camera.project(pose * body[s.feature], J);
      if (!uv) continue;
      double least = radius * radius;
      const Vec2* z = nullptr;
      for (int i = s.first; i < s.first + s.count; ++i) {
        const Vec2& corner = problem.corner[static_cast<std::size_t>(i)];
        if (const double r2 = (corner - *uv).squaredNorm(); r2 < least) {
          least = r2;
          z = &corner;
        }
      }
      if (z == nullptr) continue;
      if (std::find(supporters.begin(), supporters.end(), *z) == supporters.end()) supporters.push_back(*z);
      Jac full;
      full << -J * skew(pose.rotation().rotate(body[s.feature].xyz)), J;
      const double m = least / s.R;
      const double w = 1 / ((1 + m / c2) * (1 + m / c2) * s.R);
      residuals.push_back({s.feature, least});
      H += w * full.transpose() * full;
      g += w * full.transpose() * (*z - *uv);
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
      const Point<frame::K> place(a + p.share * (b - a));
      Eigen::Matrix<double, 2, 3> J;
      const auto uv = camera.project(pose * place, J);
      if (!uv) continue;
      Jac full;
      full << -J * skew(pose.rotation().rotate(place.xyz)), J;
      const Vec6 across = full.transpose() * p.normal;
      const double r = p.normal.dot(p.uv_px - *uv), m = r * r / variance;
      const double w = 1 / ((1 + m / c2) * (1 + m / c2) * variance);
      H += w * across * across.transpose();
      g += w * r * across;
    }
  }
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
  if (locked && track.valid) {
    const double dt = (now - t_pose).seconds();
    for (std::size_t i = 0; i < ways.size(); ++i) {
      if (i == 2 && !way_nav) continue;
      const double e = distance_px(ways[i], out.T_c_k);
      way_error_px2[i] += 0.15 * (std::min(e * e, 900.0) - way_error_px2[i]);
    }
    error_px = std::sqrt(*std::min_element(way_error_px2.begin(), way_error_px2.end()));
    const Vec6 v = difference(T, out.T_c_k) / std::max(dt, 1e-3);
    velocity += 0.6 * (v - velocity);
  } else {
    velocity.setZero();
    way_error_px2 = {{9, 9, 16}};
    error_px = 3;
  }
  T = out.T_c_k;
  t_pose = now;
  t_consensus = now;
  locked = true;
}

Aligner::Aligner(const AlignConfig& config, const TankerModel& model, const Camera& camera, const Pose<frame::C, frame::R>& T_c_r,
                 double boresight_sigma_rad)
    : s_(std::make_unique<State>(config, model, camera, T_c_r, boresight_sigma_rad)) {}
Aligner::~Aligner() = default;

void Aligner::reset() {
  s_->locked = false;
  s_->consensus_before = false;
  s_->scatter.assign(s_->scatter.size(), s_->config.corner_sigma_px * s_->config.corner_sigma_px);
  s_->scatter_frames.assign(s_->scatter_frames.size(), 0);
  s_->previous_nav = {};
  s_->has_shape = false;
}

bool Aligner::predict(Time t_mid, const RelativeState* nav) {
  s_->now = t_mid;
  s_->nav = {};
  if (nav != nullptr && nav->valid) s_->nav = s_->prior_from(*nav);
  if (s_->nav.valid) {
    s_->shape = s_->nav.P;
    s_->has_shape = true;
  }
  s_->prior_from_track();
  s_->choose_width();
  return s_->nav.valid || s_->track.valid;
}

const Pose<frame::C, frame::K>& Aligner::prior_pose() const { return s_->track.valid ? s_->track.T : s_->nav.T; }

void Aligner::step(const PredictionSet& predicted, const CornerSet& corners, Alignment& out) {
  out = {};
  State& s = *s_;
  Reading from_nav, from_track;
  double margin_nav = 0, margin_track = 0;
  const bool n = s.nav.valid && s.wide && s.read(s.nav, predicted, corners, from_nav, margin_nav);
  const bool t = s.track.valid && s.read(s.track, predicted, corners, from_track, margin_track);
  if (n || t) {
    out.from_track = t && (!n || from_track.evidence + s.config.track_bonus >= from_nav.evidence);
    const Prior& prior = out.from_track ? s.track : s.nav;
    if (!out.from_track && t) s.pose_problem(prior, predicted, corners);
    const Reading& best = out.from_track ? from_track : from_nav;
    out.evidence = best.evidence;
    out.margin = out.from_track ? margin_track : margin_nav;
    s.used = prior;
    s.refine(prior, best.d, out);
    const auto needed = static_cast<std::uint32_t>(std::max(2, s.config.min_inliers - (out.considered < 7 ? 1 : 0)));
    out.consensus = out.inliers >= needed && out.inliers >= s.config.min_support * out.considered && out.evidence >= s.config.min_evidence && out.margin >= s.config.min_margin;
    if (s.nav.valid) {
      const Vec6 gap = difference(s.nav.T, out.T_c_k);
      out.nav_disagreement = gap.dot((s.nav.P + out.covariance).ldlt().solve(gap));
    }
  }
}

void Aligner::refine(const EdgeSet& edges, Alignment& out) {
  State& s = *s_;
  if (!out.consensus || edges.empty()) return;
  s.edges = &edges;
  s.refine(s.used, difference(s.used.T, out.T_c_k), out);
  s.edges = nullptr;
}

void Aligner::learn(const Alignment& alignment) {
  s_->learn(alignment);
  s_->consensus_before = alignment.consensus;
  s_->disagreement_before = alignment.nav_disagreement;
  s_->previous_nav = s_->nav;
}

double Aligner::corner_variance_px2(std::uint16_t feature) const { return s_->scatter[feature]; }

void Aligner::apply(const Alignment& alignment, PredictionSet& predicted) const {
  if (alignment.consensus) s_->place(alignment.T_c_k, alignment.covariance, s_->config.common_px, predicted);
}

void Aligner::widen(PredictionSet& predicted) const {
  s_->place(prior_pose(), s_->nav.valid && s_->wide ? s_->nav.P : s_->track.P, 0, predicted);
}

void Aligner::State::place(const CameraPose& pose, const Mat6& P, double common_px, PredictionSet& predicted) const {
  for (Prediction& p : predicted.items) {
    if (p.visibility == Visibility::kDisabled || p.visibility == Visibility::kFacingAway || p.visibility == Visibility::kHidden) continue;
    Eigen::Matrix<double, 2, 3> J;
    const auto uv = camera.project(pose * body[p.feature], J);
    if (!uv) {
      p.visibility = Visibility::kBehindCamera;
      continue;
    }
    Jac full;
    full << -J * skew(pose.rotation().rotate(body[p.feature].xyz)), J;
    const double survey = model.features()[p.feature].sigma_m;
    p.uv_px = *uv;
    p.cov_px2 = full * P * full.transpose() + survey * survey * J * J.transpose() + common_px * common_px * Mat2::Identity();
    p.visibility = camera.inside(*uv) ? Visibility::kVisible : Visibility::kOutsideImage;
  }
}

}  // namespace cyclops
