#pragma once
/// A tracker with one or more features, driven frame by frame without image or association.
#include <memory>
#include <optional>
#include <vector>

#include "track/tracker.hpp"

namespace cyclops::test {

/// 30 Hz as whole nanoseconds; worked numbers are given for exactly 1/30 s, so compare velocities with 1e-6.
inline constexpr Duration kFrame{33333333};

inline TrackConfig thesis(Filter filter, double alpha = 0.7, double beta = 0.075) {
  TrackConfig c;
  c.filter = filter;
  c.alpha = alpha;
  c.beta = beta;
  c.blending = Blending::kNavWins;
  c.first_hit_takes_corner = false;
  return c;
}

class TrackRig {
 public:
  explicit TrackRig(const TrackConfig& config) : tracker_(std::make_unique<Tracker>(config, 1024, 1024)) {}
  Tracker& operator*() { return *tracker_; }
  [[nodiscard]] const Track& track(std::size_t i = 0) const { return tracker_->tracks()[i]; }
  [[nodiscard]] const TrackCounters& counters() const { return tracker_->counters(); }

  void begin(Duration after = kFrame) {
    if (begun_) t_ = t_ + after;
    begun_ = true;
    tracker_->begin_frame(t_);
  }
  /// With what navigation's rates of `age_s` ago say of each feature's way; none: it is behind the camera.
  void begin_moved(const std::vector<std::optional<Vec2>>& ways_px, double age_s = 0, Duration after = kFrame) {
    RigidMotion motion;
    motion.age_s = age_s;
    for (const auto& way : ways_px) motion.items.push_back(way ? Displacement{true, *way} : Displacement{});
    t_ = t_ + after;
    tracker_->begin_frame(t_, &motion);
  }
  void nav(const std::vector<Vec2>& places, double sigma_px = 3, Visibility visibility = Visibility::kVisible) {
    auto set = std::make_unique<PredictionSet>();
    set->from_nav = true;
    set->t_mid = t_;
    for (std::size_t i = 0; i < places.size(); ++i) {
      Prediction p;
      p.id = static_cast<FeatureId>(i + 1);
      p.feature = static_cast<std::uint16_t>(i);
      p.visibility = visibility;
      p.uv_px = places[i];
      p.cov_px2 = Mat2::Identity() * sigma_px * sigma_px;
      set->items.push_back(p);
    }
    tracker_->nav_update(*set);
  }
  void update(const std::vector<std::optional<Vec2>>& corners, double sigma_px = 0.5, MatchReason missed = MatchReason::kNoCornerInGate) {
    update(corners, Mat2(Mat2::Identity() * sigma_px * sigma_px), missed);
  }
  void update(const std::vector<std::optional<Vec2>>& corners, const Mat2& cov_px2, MatchReason missed) {
    corners_->items.clear();
    matches_->clear();
    for (const auto& place : corners) {
      Match m;
      m.reason = missed;
      if (place) {
        m.corner = static_cast<std::int32_t>(corners_->items.size());
        m.reason = MatchReason::kMatched;
        Corner c;
        c.uv_px = *place;
        c.cov_px2 = cov_px2;
        corners_->items.push_back(c);
      }
      matches_->push_back(m);
    }
    tracker_->update(*matches_, *corners_);
  }
  void hit(const Vec2& place, double sigma_px = 0.5) { update({place}, sigma_px); }
  void hit(const Vec2& place, const Mat2& cov_px2) { update({place}, cov_px2, MatchReason::kNoCornerInGate); }
  void miss(MatchReason reason = MatchReason::kNoCornerInGate) { update({std::nullopt}, 0.5, reason); }

 private:
  std::unique_ptr<Tracker> tracker_;
  std::unique_ptr<CornerSet> corners_{std::make_unique<CornerSet>()};
  std::unique_ptr<MatchSet> matches_{std::make_unique<MatchSet>()};
  Time t_{1000000000};
  bool begun_{false};
};

}  // namespace cyclops::test
