#pragma once
/// The life of each feature between navigation updates: start, follow, coast, end.
///
/// Order    begin_frame(t, motion); nav_update(predictions) if there are any; associate tracks(); update(matches, corners).
///          A frame without pixels gets no update(): its tracks coast and nothing is counted as missed.
/// Frames   raw pixels. T of the filters is the interval between begin_frame calls; when it is not above 0 nothing moves.
/// Starts   only a navigation update starts a track; a deleted or departed track stays off until the next one.
/// Change   Track::change holds what happened to the track in this frame, the gravest last: hit or miss, then start or replacement
///          by navigation, then the end. Whether a started track was hit too shows in its state: kLive or kCoasting.
/// Motion   kKalman: where navigation's rates say how the feature moves (RigidMotion), their change is the known input of the filter; where
///          they say nothing, the velocity is what the corners have shown.
///            v = v + w - w_before,  x = x + T v,  P = F P F^T + Q;  K = P H^T (H P H^T + R)^-1
///          w: that motion over T. Where it begins, and at an update after frames without one, it is a measurement of the velocity. Q: from
///          update to update little, else as for a velocity that nothing leads. R: the corner's covariance and corner_sigma_px.
/// Covariance  per track, of position and velocity, carried through the gains in use: x+ = x + K (z - x), P+ = (I-KH) P (I-KH)^T
///          + K R K^T (Joseph), which holds for any gain. Between frames white acceleration noise is added.
/// Score    kHits: misses less hits, floor 0 (the thesis). kLikelihood: sum of log( P_D N(innovation; S) / clutter ) for hits
///          and of log(1 - P_D) for misses, kept in Track::log_likelihood with either; a track ends when it has fallen `lost_score`
///          below its highest.
/// Check    a match that MotionCheck took out ends its track (kAgainstMotion) until navigation starts it again.
/// Threads  one object a thread. Memory: all of it in the constructor.
/// Source   spec 2.6 (filters), 2.7 (life), 2.8 (blending), errata E16, E36; log-likelihood score: Sittler 1964, Blackman & Popoli 1999, ch. 6.
#include <vector>

#include "base/config.hpp"
#include "msg/chain.hpp"
#include "track/motion_check.hpp"

namespace cyclops {

enum class Filter : std::uint8_t {
  kZoh,        ///< last corner held; deleted at the first miss (the thesis)
  kZohScore,   ///< last corner held; deleted by score
  kAlphaBeta,  ///< deleted by score
  kKalman,     ///< deleted by score; led by the motion that navigation's rates predict
};

enum class Blending : std::uint8_t {
  kNavWins,     ///< a navigation update replaces every track (the thesis)
  kCovariance,  ///< it leaves alone a track that was hit recently and lies within keep_chi_square of the prediction
};

enum class TrackScore : std::uint8_t { kHits, kLikelihood };

/// Table "track".
struct TrackConfig {
  Filter filter{Filter::kKalman};
  double alpha{0.7};                    ///< thesis: 0.7 / 0.075 baseline, 0.9 / 0.25 high rate
  double beta{0.075};
  int delete_at_score{5};
  Blending blending{Blending::kCovariance};
  double keep_chi_square{13.8};         ///< 99.9 % of 2 degrees of freedom, over track plus prediction covariance
  double keep_hit_within_s{0.2};        ///< "recently"
  double max_nav_gap_s{2};              ///< two navigation updates closer than this give a velocity
  bool first_hit_takes_corner{true};    ///< the error of a start by navigation is no motion: gains 1, 0 once. Thesis: false
  double velocity_sigma_px_s{30};       ///< of a velocity taken to be 0; about 1 px a frame at 30 Hz
  double acceleration_px2_s3{100};      ///< power spectral density of the acceleration
  double corner_sigma_px{0.7};          ///< kKalman: an axis, of a corner from the surveyed point
  double rate_sigma_px_s{5};            ///< kKalman: of the velocity that navigation predicts
  double rate_change_px2_s3{20};        ///< kKalman: power spectral density of the change of its error
  TrackScore score{TrackScore::kHits};
  double lost_score{6};                 ///< kLikelihood
  double score_most{12};                ///< log-likelihood is cut off here: an old track must be able to end
  double detection_probability{0.8};    ///< of the log-likelihood
  double clutter_per_px2{0.001};        ///< of the log-likelihood
  MotionConfig motion{};

  /// `table` is [track]; range errors are collected there.
  [[nodiscard]] static Result<TrackConfig> read(ConfigTable& table, TrackConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const TrackConfig&) const = default;
};

/// Sums since construction.
struct TrackCounters {
  std::uint64_t initiated{0};           ///< by navigation, of features that had no track
  std::uint64_t replaced{0};            ///< live tracks moved by navigation
  std::uint64_t kept{0};                ///< live tracks that navigation agreed with (kCovariance)
  std::uint64_t hits{0};
  std::uint64_t misses{0};
  std::uint64_t dropped{0};             ///< by score
  std::uint64_t left_image{0};
  std::uint64_t turned_away{0};
  std::uint64_t against_motion{0};      ///< ended because of it
  std::uint64_t late_frames{0};         ///< not later than the frame before
};

class Tracker {
 public:
  Tracker(const TrackConfig& config, int width_px, int height_px);
  /// Moves every track to t_mid.
  /// `motion`: since the begin_frame before, item i is feature i; null when nothing is known of it. Only kKalman looks at it.
  void begin_frame(Time t_mid, const RigidMotion* motion = nullptr);
  /// `predictions` are at the t_mid of begin_frame, item i is feature i. A set without navigation changes nothing.
  void nav_update(const PredictionSet& predictions);
  /// One match for each track.
  void update(const MatchSet& matches, const CornerSet& corners);

  /// Track i is feature i; empty before the first navigation update.
  [[nodiscard]] const TrackSet& tracks() const { return tracks_; }
  /// The tracks as they stood when update() began, that is, as association saw them.
  [[nodiscard]] const TrackSet& predicted() const { return predicted_; }
  [[nodiscard]] const TrackCounters& counters() const { return counters_; }

 private:
  /// What a track has beside its public face. Covariance blocks: position is Track::cov_px2, order u v.
  struct Inner {
    Mat2 cross{Mat2::Zero()};           ///< position by velocity, px^2/s
    Mat2 velocity{Mat2::Zero()};        ///< px^2/s^2
    bool hit{false};                    ///< since it was started
    double highest{0};                  ///< log-likelihood since it was started
    enum class Led : std::uint8_t { kNot, kHeld, kNow } led{Led::kNot};  ///< by navigation's rates of an earlier frame, of this one
    Vec2 led_px_s{0, 0};                ///< what those say
    double led_variance{0};             ///< of it, an axis, px^2/s^2
    bool nav_known{false};
    Vec2 nav_uv_px{0, 0};               ///< of the navigation update before
    Mat2 nav_cov_px2{Mat2::Zero()};
    Time t_nav{};
  };
  struct Gains {
    Mat2 place, velocity;               ///< velocity: per second
  };
  void lead(Track& track, Inner& inner, const RigidMotion* motion) const;
  static void take_velocity(Track& track, Inner& inner);
  void propagate(Track& track, Inner& inner, double dt) const;
  [[nodiscard]] Gains gains(const Track& track, const Inner& inner, const Mat2& R) const;
  void correct(Track& track, Inner& inner, const Corner& corner) const;
  void miss(Track& track, Inner& inner);
  void weigh(Track& track, Inner& inner, const Corner* corner) const;
  void blend(Track& track, Inner& inner, const Prediction& prediction);
  void start(Track& track, Inner& inner, const Prediction& prediction, bool was_on);
  void set_velocity(Track& track, Inner& inner, const Prediction& prediction) const;
  void end(Track& track, TrackChange change);
  [[nodiscard]] Mat2 noise(const Corner& corner) const;
  [[nodiscard]] bool consistent(const Track& track, const Inner& inner, const Prediction& prediction) const;
  [[nodiscard]] bool inside(const Vec2& uv_px) const;

  TrackConfig config_;
  int width_;
  int height_;
  bool begun_{false};
  Time t_{};
  double interval_s_{0};
  TrackSet tracks_{};
  TrackSet predicted_{};
  std::vector<Inner> inner_;
  TrackCounters counters_{};
};

}  // namespace cyclops
