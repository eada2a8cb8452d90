#pragma once
/// Inside align: has navigation stepped? Its errors are slow, so a sudden change of (navigation less aligned pose) that stays is a fault
/// long before it is implausible by navigation's covariance.
///
/// Model    y = difference(aligned, navigation), 6 degrees of freedom, is a slow bias b and scatter of covariance W = c (P_nav + P_aligned);
///          c is learned from the innovations themselves, W grows with an
///          interval longer than usual. b follows y with time constant kBias_s.
///   step     (y - b)^T W^-1 (y - b) > kStep, and the change is more than navigation's own sigma: (y - b)^T P_nav^-1 (y - b) > kLeast
/// Whose    a pose that jumps to other corners makes the same change. Navigation also says how it moves: r = difference(navigation of before,
///          moved on by its velocity and rate; navigation now), covariance S = k T P_nav + (A T^2 / 2)^2, k learned. The step is navigation's
///          when r speaks for it:
///   odds     ( r^T S^-1 r - (r - y + b)^T (S + W)^-1 (r - y + b) ) / 2 > kOdds
///          More than kSoon_s after the last comparison r says nothing: then features must have agreed in every frame since, the pose must
///          not have been corrected, r must not speak against it (odds > -1), and the limits of the step are twice as high.
/// Before   the picture is read r alone tells: r^T S^-1 r > kAstray within kSoon_s. Navigation is then kept from this frame.
/// Trial    from its first frame on; a fault when it lasts kFrames frames in which features agree and kLasts_s (longer than the widest gap
///          of reports that is interpolated: over one, a roll is drawn straight), dropped when y is back before.
/// Over     when y has been back at the bias of before, with what it may have drifted by since, for kBack_s, or when the new one has shown
///          no other step for kAccepted_s and is within navigation's covariance. kForget_s without comparison: all is forgotten.
/// Alarms   chi-square of 6 degrees of freedom above kStep: 5e-9 a comparison, one in 1900 h at 30 a second if all were Gaussian. Poses that
///          jump are not, hence the odds; docs/evaluation.md counts.
/// Time     service clock. Threads: one at a time. Memory: fixed. Source: innovation test for a jump, Willsky & Jones 1976; Basseville &
///          Nikiforov 1993.
#include "align/pose.hpp"
#include "base/time.hpp"
#include "msg/chain.hpp"
#include "msg/tspi.hpp"

namespace cyclops::align {

class NavStep {
 public:
  static constexpr double kStep = 50, kAstray = 100, kStays = 25, kLeast = 0.5, kOdds = 5;
  static constexpr double kBias_s = 0.3, kSoon_s = 0.25, kBack_s = 0.5, kAccepted_s = 10, kForget_s = 5, kTrial_s = 1, kLasts_s = 0.27;
  static constexpr int kFrames = 3;

  /// Before the picture is looked at. `nav`: what navigation says of this frame, or invalid; `per_second`: rate and velocity it came with, c
  /// axes; `sure`: it is no guess from reports long past, else the frame is not compared.
  void before(Time now, const Prior& nav, const Vec6& per_second, bool sure);
  /// Navigation has moved otherwise than it said it would.
  [[nodiscard]] bool astray() const { return astray_; }
  /// Where it is, is not to be used: on trial or found at fault.
  [[nodiscard]] bool held() const { return unsettled_ || trial_ || fault_ != NavFault::kNone; }
  /// What the frame has shown. `steady`: its pose goes on from the one before.
  void after(const Alignment& alignment, bool steady);
  [[nodiscard]] NavFault fault() const { return fault_; }
  void reset() { *this = {}; }

 private:
  struct Change {
    Vec6 d{Vec6::Zero()};
    Mat6 P{Mat6::Zero()};
  };
  /// Share of a known covariance that is seen: mean of the first ones, then of the last seconds.
  struct Scatter {
    double share{1};
    int seen{0};
    void learn(double ratio, double dt_s);
  };
  [[nodiscard]] bool of_navigation(const Vec6& change, const Mat6& W) const;
  void compare(const Alignment& alignment);
  void judge(const Vec6& change, const Mat6& W);
  void come_back(const Vec6& y, const Mat6& W, const Alignment& alignment);
  void follow(const Vec6& y);
  void lasts();

  Time now_{};
  Prior nav_{};                        // of this frame, when it may be compared
  struct Reference {
    bool valid{false};
    Time t{};
    Prior nav{};
    Vec6 per_second{Vec6::Zero()};
  } reference_;                        // newest that navigation's motion is counted from
  Change own_{};                       // navigation's motion less what it said, since the last comparison
  double own_s_{0};                    // how long that is
  Scatter own_scatter_{}, scatter_{};  // a second; a comparison
  bool astray_{false};
  bool unsettled_{false};              // it has been astray since the last comparison
  Time t_astray_{};
  int astray_frames_{0};               // in a row
  bool steady_{true};                  // since the last comparison
  double interval_s_{1};               // between comparisons, usually
  bool known_{false};
  Vec6 bias_{Vec6::Zero()};
  Time t_bias_{};                      // it last followed
  Time t_seen_{};                      // last comparison
  bool trial_{false};
  int told_{0};                        // frames of the trial that speak for it
  Time t_step_{};
  Change before_{};                    // bias before the step and its covariance
  Time t_before_{};
  Vec6 step_{Vec6::Zero()};
  Mat6 step_P_{Mat6::Identity()};
  Time t_away_{};                      // last seen away from the bias before
  NavFault fault_{NavFault::kNone};
};

}  // namespace cyclops::align
