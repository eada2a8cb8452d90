#include "align/pose_track.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops::align {
namespace {

constexpr double kErrorGain = 0.15, kVelocityGain = 0.6, kAccelerationGain = 0.7;
constexpr double kMoves_px = 2;          // a frame; where it moves less,
constexpr double kAtLast_px2 = 25;     // pictures, which are coarse, come last
constexpr double kTurn_s = 0.3;       // an acceleration is carried on for so long
constexpr double kSeen = 2;            // pictures of this frame are believed, unless they have been that much worse
constexpr double kFast_px = 10;        // a frame: motion so large hides the steps of navigation
constexpr double kLeap_px = 8;         // so far from the track, where navigation contradicted it: another track begins
constexpr double kFirst_px = 3;        // error of the first prediction with a velocity
constexpr double kLeastTurn = 0.001;   // rad
constexpr double kLeastShift = 0.001;  // of the range

}  // namespace

double PoseTrack::spread_px(const CameraPose& pose, const Mat6& P) const {
  double sum = 0;
  int n = 0;
  const std::size_t step = 1 + body_.size() / 16;
  for (std::size_t i = 0; i < body_.size(); i += step) {
    const auto seen = projected(camera_, pose, body_[i]);
    if (!seen) continue;
    sum += 0.5 * (seen->by_pose * P * seen->by_pose.transpose()).trace();
    ++n;
  }
  return n == 0 ? 0 : std::sqrt(sum / n);
}

double PoseTrack::distance_px(const CameraPose& a, const CameraPose& b) const {
  double sum = 0;
  int n = 0;
  const std::size_t step = 1 + body_.size() / 16;
  for (std::size_t i = 0; i < body_.size(); i += step) {
    const auto ua = camera_.project(a * body_[i]), ub = camera_.project(b * body_[i]);
    if (!ua || !ub) continue;
    sum += (*ua - *ub).squaredNorm();
    ++n;
  }
  return n == 0 ? 0 : std::sqrt(0.5 * sum / n);
}

void PoseTrack::predict(Time now, const Prior& nav, const Prior& motion) {
  now_ = now;
  if (nav.valid) {
    // However sure navigation is of itself now, the track must be able to follow any motion later.
    const double shift = kLeastShift * nav.T.translation().xyz.norm();
    shape_ = nav.P;
    shape_.diagonal().head<3>().array() += kLeastTurn * kLeastTurn;
    shape_.diagonal().tail<3>().array() += shift * shift;
    has_shape_ = true;
  }
  prior_ = {};
  contradicted_ = false;
  known_ = {};
  const double blind = (now - t_pose_).seconds();
  if (!locked_ || !has_shape_ || blind > config_.forget_after_s) return;
  known_ = {true, true, motion.valid && previous_nav_.valid, newest_s_ > 0 && blind < kTurn_s, false};
  ways_[kStill] = T_;
  ways_[kSteady] = moved(T_, velocity_ * blind);
  ways_[kTurning] = moved(T_, (newest_ + 0.5 * (newest_s_ + blind) * acceleration_) * blind);
  if (known_[kNavigation]) ways_[kNavigation] = moved(T_, difference(previous_nav_.T, motion.T));
  if (nav.valid) words_ = std::max(1.0, config_.nav_memory_s / std::max(1e-3, (now - t_nav_).seconds()));
  choose(nav);
}

void PoseTrack::follow(const Prior& pictures, const Prior& nav) {
  if (!known_[kStill]) return;
  known_[kPictures] = true;
  ways_[kPictures] = pictures.T;
  pictures_ = pictures;
  choose(nav);
}

/// The best way, and navigation's word on it.
void PoseTrack::choose(const Prior& nav) {
  Way best = way_error_px2_[kStill] < way_error_px2_[kSteady] ? kStill : kSteady;
  if (known_[kNavigation] && way_error_px2_[kNavigation] < way_error_px2_[best]) best = kNavigation;
  astray_ = way_error_px2_[best] > config_.track_floor_px * config_.track_floor_px;  // else these would add but noise
  if (astray_ && known_[kTurning] && way_error_px2_[kTurning] < way_error_px2_[best]) best = kTurning;
  if (astray_ && known_[kPictures] && way_error_px2_[kPictures] < kSeen * way_error_px2_[best]) best = kPictures;
  const double blind = best == kPictures ? 0 : std::max(0.0, (now_ - t_pose_).seconds() - 0.05);
  const double error = std::sqrt(way_error_px2_[best]);
  prior_ = around(ways_[best], std::max(config_.track_floor_px, error) + config_.track_growth_px_s * blind);
  if (best == kPictures) prior_.P += pictures_.P;
  contradicted_ = false;
  if (!nav.valid) return;
  const Vec6 gap = difference(prior_.T, nav.T);
  contradicted_ = gap.dot((prior_.P + nav.P).ldlt().solve(gap)) > kContradiction;
  if (contradicted_) return;  // each stands for itself
  t_nav_ = now_;
  // Navigation pulls the track towards itself as far as its covariance says, but its errors last: many words in a second are one.
  const auto solver = Mat6(prior_.P + words_ * nav.P).ldlt();
  prior_.T = moved(prior_.T, prior_.P * solver.solve(gap));
  prior_.P = prior_.P - prior_.P * solver.solve(prior_.P);
  prior_.P = 0.5 * (prior_.P + prior_.P.transpose().eval());
}

Prior PoseTrack::around(const CameraPose& pose, double px) const {
  const double scale = px / std::max(1e-6, spread_px(pose, shape_));
  return {pose, shape_ * (scale * scale), has_shape_};
}

void PoseTrack::learn(const CameraPose& pose, bool with_navigation, bool corrected) {
  const bool fast = astray_ && way_error_px2_[kStill] > kFast_px * kFast_px;
  if (locked_ && prior_.valid && corrected && !fast) {
    const bool moves = way_error_px2_[kStill] > kMoves_px * kMoves_px;
    way_error_px2_ = kFirstError_px2;
    if (!moves) way_error_px2_[kPictures] = kAtLast_px2;
    newest_s_ = 0;
    acceleration_.setZero();
  } else if (locked_ && prior_.valid && !(contradicted_ && distance_px(prior_.T, pose) > kLeap_px)) {
    const double dt = (now_ - t_pose_).seconds();
    for (std::size_t i = 0; i < ways_.size(); ++i) {
      if (!known_[i]) continue;
      const double e = distance_px(ways_[i], pose);
      way_error_px2_[i] += (fresh_ ? 1 : kErrorGain) * (std::min(e * e, 900.0) - way_error_px2_[i]);
    }
    const Vec6 v = difference(T_, pose) / std::max(dt, 1e-3);
    if (with_navigation == with_navigation_ || fast) {
      velocity_ += (fresh_ ? 1 : kVelocityGain) * (v - velocity_);
      if (newest_s_ > 0) acceleration_ += kAccelerationGain * ((v - newest_) / (0.5 * (newest_s_ + dt)) - acceleration_);
      newest_ = v;
      newest_s_ = std::max(dt, 1e-3);
    } else if (newest_s_ > 0) {
      newest_ += acceleration_ * dt;
      newest_s_ = std::max(dt, 1e-3);
    }
    if (fresh_) way_error_px2_[kSteady] = std::min(way_error_px2_[kSteady], kFirst_px * kFirst_px);  // from now on it is known how it moves
    fresh_ = false;
  } else {
    velocity_.setZero();
    acceleration_.setZero();
    newest_s_ = 0;
    way_error_px2_ = kFirstError_px2;
    way_error_px2_[kNavigation] = kFirst_px * kFirst_px;
    fresh_ = true;
  }
  T_ = pose;
  t_pose_ = now_;
  with_navigation_ = with_navigation;
  locked_ = true;
}

void PoseTrack::reset() {
  locked_ = false;
  previous_nav_ = {};
  t_nav_ = {};
  has_shape_ = false;
}

}  // namespace cyclops::align
