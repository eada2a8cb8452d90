#include "track/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cyclops {
namespace {

bool on(const Track& track) { return track.state == TrackState::kLive || track.state == TrackState::kCoasting; }

/// Has a velocity.
bool moves(Filter filter) { return filter == Filter::kAlphaBeta || filter == Filter::kKalman; }

void copy(const TrackSet& from, TrackSet& to) {  // only those in use: the whole array is large
  to.clear();
  for (const Track& track : from) to.push_back(track);
}

}  // namespace

Result<TrackConfig> TrackConfig::read(ConfigTable& table, TrackConfig c) {
  table.read_enum("filter", {"zoh", "zoh-score", "alpha-beta", "kalman"}, c.filter);
  table.read_in("alpha", 0.0, 1.0, c.alpha);
  table.read_in("beta", 0.0, 2.0, c.beta);
  if (!(2 * c.alpha + c.beta < 4)) table.fail("beta", "with this alpha the filter is unstable, expected 2 alpha + beta < 4");
  table.read_in("delete_at_score", 1, 1000, c.delete_at_score);
  table.read_enum("blending", {"nav-wins", "covariance"}, c.blending);
  table.read_in("keep_chi_square", 0.0, 1000.0, c.keep_chi_square);
  table.read_in("keep_hit_within_s", 0.0, 60.0, c.keep_hit_within_s);
  table.read_in("max_nav_gap_s", 0.0, 60.0, c.max_nav_gap_s);
  table.read("first_hit_takes_corner", c.first_hit_takes_corner);
  table.read_in("velocity_sigma_px_s", 0.0, 10000.0, c.velocity_sigma_px_s);
  table.read_in("acceleration_px2_s3", 0.0, 1e6, c.acceleration_px2_s3);
  table.read_in("corner_sigma_px", 0.0, 50.0, c.corner_sigma_px);
  table.read_in("rate_sigma_px_s", 0.0, 10000.0, c.rate_sigma_px_s);
  table.read_in("rate_change_px2_s3", 0.0, 1e6, c.rate_change_px2_s3);
  table.read_enum("score", {"hits", "likelihood"}, c.score);
  table.read_in("lost_score", 0.1, 1000.0, c.lost_score);
  table.read_in("score_most", 0.0, 1000.0, c.score_most);
  table.read_in("detection_probability", 0.01, 0.999, c.detection_probability);
  table.read_in("clutter_per_px2", 1e-9, 1.0, c.clutter_per_px2);
  c.motion.read(table);
  return c;
}

Tracker::Tracker(const TrackConfig& config, int width_px, int height_px)
    : config_(config), width_(width_px), height_(height_px), inner_(kMaxFeatures) {}

bool Tracker::inside(const Vec2& uv) const {
  return uv.x() >= -0.5 && uv.y() >= -0.5 && uv.x() < width_ - 0.5 && uv.y() < height_ - 0.5;
}

// --- from frame to frame ---------------------------------------------------------------------------------------

/// What navigation's rates say of the velocity: its change while they are of one update, or of updates in a row; else a measurement of it.
void Tracker::lead(Track& track, Inner& inner, const RigidMotion* motion) const {
  using Led = Inner::Led;
  const Led before = inner.led;
  const Vec2 was_px_s = inner.led_px_s;
  const Displacement* way = motion == nullptr || interval_s_ <= 0 ? nullptr : &motion->items[track.feature];
  inner.led = way == nullptr || !way->known ? Led::kNot : motion->age_s > 0 ? Led::kHeld : Led::kNow;
  if (inner.led == Led::kNot) return;
  inner.led_px_s = way->px / interval_s_;
  inner.led_variance = config_.rate_sigma_px_s * config_.rate_sigma_px_s + config_.acceleration_px2_s3 * motion->age_s;
  if (!on(track)) return;
  if (before == Led::kNot || (before == Led::kHeld && inner.led == Led::kNow)) take_velocity(track, inner);
  else track.velocity_px_s += inner.led_px_s - was_px_s;
}

/// The place follows by its correlation, H = [0 I].
void Tracker::take_velocity(Track& track, Inner& inner) {
  const Mat2 S = inner.velocity + inner.led_variance * Mat2::Identity();
  if (!(S.determinant() > 0)) return;
  const Mat2 Kx = inner.cross * S.inverse(), Kv = inner.velocity * S.inverse();
  const Vec2 residual = inner.led_px_s - track.velocity_px_s;
  track.uv_px += Kx * residual;
  track.velocity_px_s += Kv * residual;
  track.cov_px2 -= Kx * inner.cross.transpose();
  inner.cross -= Kx * inner.velocity;
  inner.velocity -= Kv * inner.velocity;
}

/// x = x + T v; F = [1 T; 0 1] and white acceleration noise of density q: q [T^3/3 T^2/2; T^2/2 T].
void Tracker::propagate(Track& track, Inner& inner, double dt) const {
  track.uv_px += dt * track.velocity_px_s;
  const double q = inner.led == Inner::Led::kNow ? config_.rate_change_px2_s3 : config_.acceleration_px2_s3;
  track.cov_px2 += dt * (inner.cross + inner.cross.transpose()) + dt * dt * inner.velocity + q * dt * dt * dt / 3 * Mat2::Identity();
  inner.cross += dt * inner.velocity + q * dt * dt / 2 * Mat2::Identity();
  if (moves(config_.filter)) inner.velocity += q * dt * Mat2::Identity();
}

void Tracker::begin_frame(Time t_mid, const RigidMotion* motion) {
  CYCLOPS_ASSERT(motion == nullptr || tracks_.empty() || motion->items.size() == tracks_.size());
  interval_s_ = begun_ ? (t_mid - t_).seconds() : 0;
  if (begun_ && interval_s_ <= 0) {
    ++counters_.late_frames;
    interval_s_ = 0;
  }
  begun_ = true;
  t_ = t_mid;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    track.change = TrackChange::kNone;
    if (config_.filter == Filter::kKalman) lead(track, inner_[i], motion);
    if (!on(track)) continue;
    propagate(track, inner_[i], interval_s_);
    if (!inside(track.uv_px)) end(track, TrackChange::kLeftImage);
  }
}

void Tracker::end(Track& track, TrackChange change) {
  track.change = change;
  const bool deleted = change == TrackChange::kDeletedByScore || change == TrackChange::kAgainstMotion;
  track.state = deleted ? TrackState::kDeleted : TrackState::kNone;
  if (change == TrackChange::kAgainstMotion) ++counters_.against_motion;
  if (change == TrackChange::kDeletedByScore) ++counters_.dropped;
  if (change == TrackChange::kLeftImage) ++counters_.left_image;
  if (change == TrackChange::kTurnedAway) ++counters_.turned_away;
}

// --- navigation ------------------------------------------------------------------------------------------------

bool Tracker::consistent(const Track& track, const Inner& inner, const Prediction& prediction) const {
  if (!inner.hit || (t_ - track.t_last_hit).seconds() > config_.keep_hit_within_s) return false;
  const Vec2 d = prediction.uv_px - track.uv_px;
  const Mat2 S = track.cov_px2 + prediction.cov_px2;
  return S.determinant() > 0 && d.dot(S.inverse() * d) <= config_.keep_chi_square;
}

/// What navigation's rates say in this frame; else the difference of two projections close enough in time (a constant bias cancels, spec 2.8);
/// else what they said of late; else 0.
void Tracker::set_velocity(Track& track, Inner& inner, const Prediction& prediction) const {
  track.velocity_px_s = Vec2::Zero();
  inner.velocity = config_.velocity_sigma_px_s * config_.velocity_sigma_px_s * Mat2::Identity();
  inner.cross = Mat2::Zero();
  const double gap = (t_ - inner.t_nav).seconds();
  const bool difference = moves(config_.filter) && inner.nav_known && gap > 0 && gap <= config_.max_nav_gap_s;
  if (inner.led == Inner::Led::kNow || (inner.led == Inner::Led::kHeld && !difference)) {
    track.velocity_px_s = inner.led_px_s;
    inner.velocity = inner.led_variance * Mat2::Identity();
    return;
  }
  if (!difference) return;
  track.velocity_px_s = (prediction.uv_px - inner.nav_uv_px) / gap;
  inner.velocity = (prediction.cov_px2 + inner.nav_cov_px2) / (gap * gap) + config_.acceleration_px2_s3 * gap / 3 * Mat2::Identity();
}

void Tracker::start(Track& track, Inner& inner, const Prediction& prediction, bool was_on) {
  set_velocity(track, inner, prediction);
  track.state = TrackState::kLive;
  track.change = was_on ? TrackChange::kReplacedByNav : TrackChange::kInitiatedByNav;
  track.uv_px = prediction.uv_px;
  track.cov_px2 = prediction.cov_px2;
  track.score = 0;
  track.log_likelihood = 0;
  inner.highest = 0;
  inner.hit = false;
  ++(was_on ? counters_.replaced : counters_.initiated);
}

/// What one prediction does to its track.
void Tracker::blend(Track& track, Inner& inner, const Prediction& prediction) {
  if (track.change == TrackChange::kLeftImage) --counters_.left_image;  // navigation decides instead of the propagated place
  const bool was_on = on(track) || track.change == TrackChange::kLeftImage;
  const bool may_keep = config_.blending == Blending::kCovariance && on(track) &&
                        (prediction.visibility == Visibility::kVisible || prediction.visibility == Visibility::kOutsideImage);
  if (may_keep && consistent(track, inner, prediction)) { ++counters_.kept; return; }
  switch (prediction.visibility) {
    case Visibility::kVisible: start(track, inner, prediction, was_on); return;
    case Visibility::kOutsideImage:
    case Visibility::kBehindCamera:
      if (was_on) end(track, TrackChange::kLeftImage);
      break;
    case Visibility::kFacingAway:
    case Visibility::kHidden:
    case Visibility::kDisabled:
      if (was_on) end(track, TrackChange::kTurnedAway);
      break;
  }
  track.state = TrackState::kNone;
}

void Tracker::nav_update(const PredictionSet& predictions) {
  if (!predictions.from_nav) return;
  CYCLOPS_ASSERT(begun_ && predictions.t_mid == t_);
  CYCLOPS_ASSERT(tracks_.empty() || tracks_.size() == predictions.items.size());
  tracks_.resize(predictions.items.size());
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const Prediction& prediction = predictions.items[i];
    CYCLOPS_ASSERT(prediction.feature == i);
    Inner& inner = inner_[i];
    tracks_[i].id = prediction.id;
    tracks_[i].feature = prediction.feature;
    blend(tracks_[i], inner, prediction);
    inner.nav_known = prediction.visibility != Visibility::kBehindCamera;
    inner.nav_uv_px = prediction.uv_px;
    inner.nav_cov_px2 = prediction.cov_px2;
    inner.t_nav = t_;
  }
}

// --- corners ---------------------------------------------------------------------------------------------------

/// Of a corner as a measurement of the track.
Mat2 Tracker::noise(const Corner& corner) const {
  const double sigma = config_.filter == Filter::kKalman ? config_.corner_sigma_px : 0;
  return corner.cov_px2 + sigma * sigma * Mat2::Identity();
}

/// Of the innovation r = z - x into place and velocity: alpha, beta / T (spec 2.6), or those of least variance, H = [I 0]: A S^-1, B^T S^-1
/// with S = A + R. Zero-order hold is 1, 0, and so is the first hit where a start by navigation shows no motion.
Tracker::Gains Tracker::gains(const Track& track, const Inner& inner, const Mat2& R) const {
  if (!moves(config_.filter) || (config_.first_hit_takes_corner && !inner.hit)) return {Mat2::Identity(), Mat2::Zero()};
  if (config_.filter == Filter::kAlphaBeta)
    return {config_.alpha * Mat2::Identity(), (interval_s_ <= 0 ? 0.0 : config_.beta / interval_s_) * Mat2::Identity()};
  const Mat2 S = track.cov_px2 + R;
  if (!(S.determinant() > 0)) return {Mat2::Zero(), Mat2::Zero()};
  return {track.cov_px2 * S.inverse(), inner.cross.transpose() * S.inverse()};
}

/// x+ = x + K r, and the covariance that goes with these gains.
void Tracker::correct(Track& track, Inner& inner, const Corner& corner) const {
  const Mat2 R = noise(corner), A = track.cov_px2, B = inner.cross;
  const auto [place, velocity] = gains(track, inner, R);
  const Mat2 left = Mat2::Identity() - place;
  const Vec2 residual = corner.uv_px - track.uv_px;
  track.uv_px += place * residual;
  track.velocity_px_s += velocity * residual;
  track.cov_px2 = left * A * left.transpose() + place * R * place.transpose();
  inner.cross = left * (B - A * velocity.transpose()) + place * R * velocity.transpose();
  inner.velocity += velocity * (A + R) * velocity.transpose() - velocity * B - B.transpose() * velocity.transpose();
}

/// One frame's part of the log-likelihood ratio "follows the feature" to "follows clutter"; `corner` null: a miss. Before correct().
void Tracker::weigh(Track& track, Inner& inner, const Corner* corner) const {
  const double p = config_.detection_probability;
  double gain = std::log(1 - p);
  if (corner != nullptr) {
    const Mat2 S = track.cov_px2 + noise(*corner);
    const Vec2 d = corner->uv_px - track.uv_px;
    const double det = S.determinant();
    gain = det > 0 ? std::log(p / (config_.clutter_per_px2 * 2 * std::numbers::pi * std::sqrt(det))) - 0.5 * d.dot(S.inverse() * d) : 0;
  }
  track.log_likelihood = std::min(config_.score_most, track.log_likelihood + gain);
  inner.highest = std::max(inner.highest, track.log_likelihood);
}

void Tracker::miss(Track& track, Inner& inner) {
  ++counters_.misses;
  ++track.score;
  weigh(track, inner, nullptr);
  const bool lost = config_.score == TrackScore::kLikelihood ? track.log_likelihood < inner.highest - config_.lost_score
                                                             : track.score >= config_.delete_at_score;
  if (config_.filter == Filter::kZoh || lost) {
    end(track, TrackChange::kDeletedByScore);
    return;
  }
  track.state = TrackState::kCoasting;
  if (track.change == TrackChange::kNone) track.change = TrackChange::kMiss;
}

void Tracker::update(const MatchSet& matches, const CornerSet& corners) {
  CYCLOPS_ASSERT(matches.size() == tracks_.size());
  copy(tracks_, predicted_);
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    if (!on(track)) continue;
    if (matches[i].reason == MatchReason::kAgainstMotion) {
      end(track, TrackChange::kAgainstMotion);
      continue;
    }
    if (matches[i].corner < 0) {
      miss(track, inner_[i]);
      continue;
    }
    weigh(track, inner_[i], &corners.items[static_cast<std::size_t>(matches[i].corner)]);
    correct(track, inner_[i], corners.items[static_cast<std::size_t>(matches[i].corner)]);
    inner_[i].hit = true;
    ++counters_.hits;
    track.score = std::max(0, track.score - 1);
    track.t_last_hit = t_;
    track.state = TrackState::kLive;
    if (track.change == TrackChange::kNone) track.change = TrackChange::kHit;
  }
}

}  // namespace cyclops
