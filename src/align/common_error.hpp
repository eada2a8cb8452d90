#pragma once
/// Inside align: the error that all features of a frame share because the pose may be wrong in a way its covariance does not know.
///
/// Corners that are chosen among several, edges that are parallel, a survey that is off: the pose settles where most of them agree, and
/// what they do not know in common shows in two ways. Corners lie a typical distance from the pose they agree on, and only a part of the
/// features finds one at all. When nearly all do, the shared error is a small part of that distance; when half of them do not, chance
/// chose as much as the tanker did, and all of the distance may be shared. An empirical rule (docs/evaluation.md says how well it holds).
/// Time: frames with consensus count, about the last 20. Threads: one at a time. Memory: fixed.
#include <algorithm>

#include "align/align_config.hpp"

namespace cyclops::align {

class CommonError {
 public:
  explicit CommonError(const AlignConfig& config) : config_(config) {}

  /// 1 sigma an axis, px. `support`: share of the features in view that a corner supports; `residual_px`: their median distance; `held`:
  /// landmarks hold the pose, so that doubtful corners do not pull it as far.
  [[nodiscard]] double sigma_px(double support, double residual_px, bool held = false) const {
    const double typical = known_ ? residual_px_ : residual_px;
    return std::max(config_.common_floor_px, typical * (config_.common_share + (1 - config_.common_share) * doubt(support) * (held ? kHeld : 1)));
  }

  /// 0: so many features find a corner that their pose is to be trusted, 1: so few that it may be off by all of a corner's distance.
  [[nodiscard]] double doubt(double support) const {
    const double share = known_ ? support_ : support;
    return std::clamp((config_.sure_support - share) / std::max(1e-9, config_.sure_support - config_.doubtful_support), 0.0, 1.0);
  }

  void learn(double support, double residual_px) {
    const double gain = known_ ? kGain : 1;
    support_ += gain * (support - support_);
    residual_px_ += gain * (residual_px - residual_px_);
    known_ = true;
  }

  void reset() { known_ = false; }

 private:
  static constexpr double kGain = 0.05;
  static constexpr double kHeld = 0.7;
  const AlignConfig& config_;
  bool known_{false};
  double support_{0}, residual_px_{0};
};

}  // namespace cyclops::align
