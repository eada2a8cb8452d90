#include "align/nav_step.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops::align {
namespace {

constexpr double kTurn_rps2 = 0.1, kShift_mps2 = 0.5;  // relative accelerations that an update does not know, 1 sigma
constexpr double kMemory_s = 3;
constexpr double kIntervalGain = 0.2;
constexpr double kOutlier = 9;       // of what has been seen so far; more teaches no more
constexpr double kWalk = 0.05;       // the bias of before goes on changing by this share of navigation's covariance a second
constexpr int kFrozenFrames = 3;
constexpr double kPlausible = 27.9;  // 99.99 % of chi-square with 6 degrees of freedom

}  // namespace

void NavStep::Scatter::learn(double ratio, double dt_s) {
  const double gain = std::max(1 - std::exp(-dt_s / kMemory_s), 1.0 / (2 + seen));
  ++seen;
  share += gain * (std::min(ratio, kOutlier * share) - share);
  share = std::max(share, 1e-3);
}

void NavStep::before(Time now, const Prior& nav, const Vec6& per_second, bool sure) {
  if (known_ && (now - t_seen_).seconds() > kForget_s) reset();
  now_ = now;
  nav_ = nav;
  nav_.valid = nav.valid && sure;
  astray_ = false;
  if ((now - t_astray_).seconds() > kTrial_s) unsettled_ = false;
  if (trial_ && (now - t_step_).seconds() > kTrial_s) trial_ = false;
  if (!nav_.valid) return;
  if (const double T = (now - reference_.t).seconds(); reference_.valid && T > 0 && T < kForget_s) {
    const Vec6 r = difference(moved(reference_.nav.T, Vec6(reference_.per_second * T)), nav.T);
    const Mat6 a_second = 0.5 * T * (reference_.nav.P + nav.P);
    Mat6 S = own_scatter_.share * a_second;
    S.diagonal().head<3>().array() += std::pow(0.5 * kTurn_rps2 * T * T, 2);
    S.diagonal().tail<3>().array() += std::pow(0.5 * kShift_mps2 * T * T, 2);
    astray_ = T < kSoon_s && own_scatter_.seen >= kFrames && squared_length(r, S) > kAstray;
    own_.d += r;
    own_.P += S;
    own_s_ += T;
    own_scatter_.learn(squared_length(r, a_second) / 6, T);
  }
  astray_frames_ = astray_ ? astray_frames_ + 1 : 0;
  if (astray_) {
    unsettled_ = true;
    t_astray_ = now;
  }
  reference_ = {true, now, nav, per_second};
}

/// Two explanations of a change: navigation made it, and says so itself; or the pose did.
bool NavStep::of_navigation(const Vec6& change, const Mat6& W) const {
  const double by_pose = squared_length(own_.d, own_.P), by_navigation = squared_length(own_.d - change, own_.P + W);
  const double odds = 0.5 * (by_pose - by_navigation);
  if (own_s_ <= kSoon_s) return odds > kOdds;
  return steady_ && odds > -1 && squared_length(change, W) > 2 * kStep && squared_length(change, nav_.P) > 2 * kLeast;
}

void NavStep::after(const Alignment& alignment, bool steady) {
  steady_ = steady_ && steady;
  if (!alignment.consensus) return;
  if (nav_.valid) compare(alignment);
  else if (trial_ && steady) lasts();
}

void NavStep::compare(const Alignment& alignment) {
  const Vec6 y = difference(alignment.T_c_k, nav_.T);
  const Mat6 both = nav_.P + alignment.covariance;
  if (known_) {
    const double interval_s = (now_ - t_seen_).seconds();
    const double longer = std::max(1.0, interval_s / interval_s_);  // than usual: as much more that may have happened
    const Mat6 W = scatter_.share * longer * both;
    judge(y - bias_, W);
    if (trial_ || fault_ != NavFault::kNone) come_back(y, W, alignment);
    if (!trial_) scatter_.learn(squared_length(y - bias_, longer * both) / 6, interval_s);
    interval_s_ += kIntervalGain * (interval_s - interval_s_);
  }
  if (!trial_) follow(y);
  t_seen_ = now_;
  unsettled_ = false;
  own_ = {};
  own_s_ = 0;
  own_.P.diagonal().setConstant(1e-14);
  steady_ = true;
}

void NavStep::follow(const Vec6& y) {
  const double gain = known_ ? 1 - std::exp(-(now_ - t_bias_).seconds() / kBias_s) : 1;
  bias_ += gain * (y - bias_);
  t_bias_ = now_;
  known_ = true;
}

void NavStep::judge(const Vec6& change, const Mat6& W) {
  if (trial_ || scatter_.seen < kFrames || squared_length(change, W) < kStep || squared_length(change, nav_.P) < kLeast || !of_navigation(change, W)) return;
  if (fault_ == NavFault::kNone) {
    before_ = {bias_, W};
    t_before_ = now_;
  }
  trial_ = true;
  told_ = 0;
  t_step_ = now_;
  step_ = change;
  step_P_ = nav_.P;
}

/// In a trial and after: is navigation where it was before?
void NavStep::come_back(const Vec6& y, const Mat6& W, const Alignment& alignment) {
  const Mat6 P = before_.P + W + kWalk * (now_ - t_before_).seconds() * nav_.P;
  const bool away = squared_length(y - before_.d, P) > kStays;
  if (away) t_away_ = now_;
  if (trial_ && !away && fault_ == NavFault::kNone) trial_ = false;
  if (trial_ && away) lasts();
  if (fault_ == NavFault::kNone) return;
  const bool back = !away && (now_ - t_away_).seconds() > kBack_s;
  const bool accepted = !trial_ && (now_ - t_step_).seconds() > kAccepted_s && alignment.nav_disagreement < kPlausible;
  if (!back && !accepted) return;
  fault_ = NavFault::kNone;
  trial_ = false;
  bias_ = y;
}

/// One more frame that speaks for the trial.
void NavStep::lasts() {
  if (++told_ < kFrames || (now_ - t_step_).seconds() < kLasts_s) return;
  trial_ = false;
  const Vec6 sigma = step_P_.diagonal().cwiseSqrt();
  const double turned = (step_.head<3>().array() / sigma.head<3>().array()).matrix().squaredNorm();
  const double shifted = (step_.tail<3>().array() / sigma.tail<3>().array()).matrix().squaredNorm();
  fault_ = astray_frames_ >= kFrozenFrames ? NavFault::kMotion : turned > shifted ? NavFault::kAttitudeStep : NavFault::kPositionStep;
  bias_ += step_;
  t_bias_ = now_;
}

}  // namespace cyclops::align
