#include "align/align.hpp"

#include <algorithm>
#include <cmath>

#include "align/aligner_state.hpp"

namespace cyclops {
namespace {

using align::CameraPose;
using align::difference;
using align::Prior;
using align::projected;
using align::Vec6;

constexpr double kScatterWorth = 5;  // residuals that the first guess of a feature's scatter is worth
constexpr double kTooFar_m = 1e4;
constexpr double kNavLead = 5;       // evidence
constexpr double kTrust_s = 0.5;     // without consensus, in which the word of the track loses weight
constexpr double kOld_s = 0.06;      // navigation further beyond its newest report, or in a gap, is a guess: not compared
constexpr double kLoose = 2.5;         // where corners are not to be doubted, landmarks, which lag, count so much less
constexpr std::size_t kEnough = 6;      // landmarks to hold all of a pose
constexpr double kMemory_s = 1;         // without corners that agree
constexpr double kLeastLandmarks = 4;   // independent ones
constexpr double kMostLandmarks = 0.6;  // of those found have to agree
constexpr double kTighten[] = {16, 8, 4, 2, 1};  // times their 1 sigma: at first none is an outlier
constexpr double kAnySigma_px = 100;
constexpr double kSharp_px = 0.8;       // larger 1 sigma of a landmark that counts: of an edge it is the expected place that agrees
constexpr double kMostDoubt = 100;    // times its covariance, at which navigation that is at fault is still a place to search about

}  // namespace

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

void Aligner::State::take_navigation(const RelativeState& state) {
  said = prior_from(state);
  nav_covariance_r = state.covariance;
  Vec6 per_second;
  per_second.head<3>() = T_c_r.rotation().rotate(state.rate_r);
  per_second.tail<3>() = T_c_r.rotation().rotate(state.velocity_r);
  const double age_s = std::max(state.age_receiver, state.age_tanker).seconds();
  nav_step.before(now, said, per_second, !state.extrapolated || (age_s > 0 && age_s < kOld_s));
}

/// While navigation is at fault the picture goes on without it. Where there is no pose to go on from, or where nothing but its distance
/// speaks against it, its covariance is as large as it has shown.
Prior Aligner::State::believed() const {
  Prior p = said;
  if (!p.valid || (!nav_step.held() && !watch.suspect())) return p;
  if (nav_step.held() && track.blind_s(now) < config.acquire_blind_s) p.valid = false;
  p.P *= std::clamp(said_off / 6, 1.0, kMostDoubt);
  return p;
}

double Aligner::State::track_bonus() const {
  return track.contradicted() ? -kNavLead : config.track_bonus * std::exp(-track.blind_s() / kTrust_s);
}

/// A wide prior leaves room for readings by chance, a narrow one for none.
bool Aligner::State::agreed(const Alignment& a, const View& view) const {
  const bool by_chance = view.spread_px > config.wide_px && support(a) < config.sure_support;
  const double margin = by_chance ? config.wide_margin : config.min_margin;
  const auto needed = static_cast<std::uint32_t>(std::max(2, config.min_inliers - (a.considered < 7 ? 1 : 0)));
  return a.inliers >= needed && a.inliers >= config.min_support * a.considered && a.evidence >= config.min_evidence && a.margin >= margin;
}

void Aligner::State::compare_with_navigation(Alignment& out) const {
  if (!said.valid) return;
  out.nav_disagreement = align::squared_distance(said.T, out.T_c_k, said.P + out.covariance);
}

/// What this frame teaches about predicting the next one.
void Aligner::State::learn(const Alignment& out) {
  if (!out.consensus && acquired) track.learn(acquired->pose.T, nav.valid, false);
  if (!out.consensus) return;
  track.learn(out.T_c_k, nav.valid, corrected);
  if (out.by_landmarks) return;
  corners_agreed = true;
  t_corners = now;
  const double n = static_cast<double>(residuals.size());
  const double lost = n > 3.5 ? n / (n - 3) : 4;  // six parameters were fitted to 2 n numbers
  for (const Residual& r : residuals) {
    double& v = scatter[r.feature];
    double& seen = scatter_frames[r.feature];
    const double gain = config.scatter_gain == 0 ? 0 : std::max(config.scatter_gain, 1 / (kScatterWorth + seen++));
    v += gain * (std::min(0.5 * r.square_px2 * lost, 9.0) - v);
    v = std::max(v, config.scatter_floor_px * config.scatter_floor_px);
  }
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
  s_->acquirer.reset();
  s_->common.reset();
  s_->corners_agreed = false;
  s_->nav_step.reset();
  s_->watch = {};
  s_->said_off = 0;
}

bool Aligner::predict(Time t_mid, const RelativeState* nav, const RelativeState* carried) {
  State& s = *s_;
  s.now = t_mid;
  s.said = {};
  if (nav != nullptr && nav->valid) s.take_navigation(*nav);
  else s.nav_step.before(t_mid, {}, Vec6::Zero(), false);
  s.between = s.nav = s.believed();
  if (!s.said.valid && carried != nullptr && (s.anchor.held() || !s.nav_step.held())) {
    s.between = s.prior_from(*carried);
    s.anchor.hold(*carried, s.T_c_r.rotation().matrix(), s.between);
  }
  s.track.predict(t_mid, s.between, s.said.valid && !s.nav_step.astray() ? s.said : s.between);
  return s.nav.valid || s.track.prior().valid;
}

bool Aligner::follow(const LandmarkSet& moved, double give_px) {
  State& s = *s_;
  const Prior& last = s.track.prior();
  if (!last.valid || static_cast<double>(moved.size()) < kLeastLandmarks) return false;
  Prior from = s.track.around(s.shifted(last.T, moved), give_px), body;
  for (const double loose : kTighten) {
    body = s.held(moved, loose, from);
    from.T = body.T;
  }
  Alignment agreed;
  agreed.T_c_k = body.T;
  s.count_agreeing(moved, kAnySigma_px, agreed);
  if (agreed.inliers < std::max(kLeastLandmarks, kMostLandmarks * static_cast<double>(moved.size()))) return false;
  s.track.follow(body, s.between);
  return true;
}

bool Aligner::acquiring() const { return s_->wide(s_->sharpest()); }

const Pose<frame::C, frame::K>& Aligner::prior_pose() const { return s_->track.prior().valid ? s_->track.prior().T : s_->nav.T; }

void Aligner::step(const PredictionSet& predicted, const CornerSet& corners, Alignment& out) {
  out = {};
  State& s = *s_;
  s.acquired.reset();
  s.corrected = false;
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
    out.consensus = s.agreed(out, view);
  }
}

bool Aligner::recall(PredictionSet& predicted, Alignment& expected) const {
  const State& s = *s_;
  const Prior& last = s.track.prior();
  if (!last.valid || s.track.contradicted() || !s.corners_agreed || (s.now - s.t_corners).seconds() > kMemory_s) return false;
  expected = {};
  expected.consensus = expected.from_track = expected.by_landmarks = true;
  expected.T_c_k = last.T;
  expected.covariance = last.P;
  s.place(last.T, last.P, 0, predicted);
  return true;
}

void Aligner::recognise(const LandmarkSet& landmarks, std::size_t in_view, Alignment& out) {
  State& s = *s_;
  if (out.consensus || static_cast<double>(landmarks.size()) < kLeastLandmarks) return;
  Alignment found;
  found.from_track = found.by_landmarks = true;
  found.considered = static_cast<std::uint32_t>(in_view);
  const Prior pose = s.held(landmarks, 1, s.track.prior());
  found.T_c_k = pose.T;
  found.covariance = pose.P;
  s.count_agreeing(landmarks, kSharp_px, found);
  const double least = std::max({kLeastLandmarks, kMostLandmarks * static_cast<double>(landmarks.size()), s.config.min_support * static_cast<double>(in_view)});
  if (found.inliers < least) return;
  found.common_px = s.common.sigma_px(support(found), found.residual_px);
  s.compare_with_navigation(found);
  found.consensus = true;
  out = found;
}

void Aligner::search(const PredictionSet& predicted, const CornerSet& corners, Alignment& out) {
  if (!out.consensus) s_->acquire(predicted, corners, out);
  if (!out.by_landmarks) s_->doubt(predicted, corners, out);
}

void Aligner::refine(const EdgeSet& edges, Alignment& out) {
  State& s = *s_;
  if (!out.consensus || out.by_landmarks || edges.empty()) return;
  s.edges = &edges;
  s.refine(*s.used, difference(s.used->prior.T, out.T_c_k), out);
  s.edges = nullptr;
  s.compare_with_navigation(out);
}

void Aligner::hold(const LandmarkSet& landmarks, Alignment& out) {
  State& s = *s_;
  if (!out.consensus || out.by_landmarks || landmarks.empty() || s.corrected) return;
  if (landmarks.size() >= kEnough) out.common_px = s.common.sigma_px(support(out), out.residual_px, true);
  out.T_c_k = s.held(landmarks, 1 + kLoose * (1 - s.common.doubt(support(out))), {out.T_c_k, out.covariance, true}).T;
  s.compare_with_navigation(out);
}

void Aligner::learn(const Alignment& alignment) {
  State& s = *s_;
  if (s.said.valid) s.anchor.set(s.said.T, s.nav_covariance_r, alignment);
  else if (s.corrected) s.anchor.reset();  // it was of the pose that has been left
  if (s.nav_step.astray()) s.anchor.reset();
  s.learn(alignment);
  s.nav_step.after(alignment, alignment.consensus && !alignment.by_landmarks && !s.corrected && s.used != &s.by_search);
  s.watch.update(s.now, s.said.valid, alignment);
  if (alignment.consensus && s.said.valid) s.said_off = alignment.nav_disagreement;
  s.track.end_frame(s.said);
}

NavFault Aligner::nav_fault() const {
  if (s_->nav_step.fault() != NavFault::kNone) return s_->nav_step.fault();
  return s_->watch.suspect() ? NavFault::kDisagrees : NavFault::kNone;
}

double Aligner::corner_variance_px2(std::uint16_t feature) const { return s_->scatter[feature]; }

void Aligner::apply(const Alignment& alignment, PredictionSet& predicted) const {
  if (alignment.consensus) s_->place(alignment.T_c_k, alignment.covariance, alignment.common_px, predicted);
}

void Aligner::widen(PredictionSet& predicted) const {
  s_->place(prior_pose(), s_->sharpest().P, 0, predicted);
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
