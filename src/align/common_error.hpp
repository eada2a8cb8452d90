#pragma once
/// Inside align: the error that all features of a frame share because the pose may be wrong in a way its covariance does not know.
///
/// Corners that are chosen among several, edges that are parallel, a survey that is off: the pose settles where most of them agree, and
/// what they do not know in common shows in two ways. Corners lie a typical distance from the pose they agree on, and only a part of the
/// features finds one at all. When most do, the shared error is about that of a mean of so many distances; when half of them do not,
/// chance chose as much as the tanker did, and all of the distance may be shared. An empirical rule (docs/evaluation.md says how well it holds).
/// Time: frames with consensus count, about the last 20. Threads: one at a time. Memory: fixed.
#include <algorithm>
#include <cmath>

#include "align/align_config.hpp"

namespace cyclops::align {

class CommonError {
 public:
  explicit CommonError(const AlignConfig& config) : config_(config) {}

  /// What one frame shows, or the mean of some.
  struct Shown {
    double support{0};      ///< share of the features in view that a corner supports,
    double features{0};     ///< how many these are
    double residual_px{0};  ///< and their median distance
  };

  /// 1 sigma an axis, px: what is believed, and goes out with measurements.
  [[nodiscard]] double sigma_px(const Shown& frame) const {
    const Shown& s = known_ ? mean_ : frame;
    return std::max(config_.common_floor_px, kAnAxis * of_distance(s, config_.common_share / std::sqrt(std::max(1.0, s.features)), config_.common_support));
  }

  /// Not less: what is allowed for where corners are looked for and matched.
  [[nodiscard]] double allowed_px(const Shown& frame) const {
    return std::max(sigma_px(frame), of_distance(known_ ? mean_ : frame, config_.allowed_share, config_.sure_support));
  }

  void learn(const Shown& frame) {
    const double gain = known_ ? kGain : 1;
    mean_.support += gain * (frame.support - mean_.support);
    mean_.features += gain * (frame.features - mean_.features);
    mean_.residual_px += gain * (frame.residual_px - mean_.residual_px);
    known_ = true;
  }

  void reset() { known_ = false; }

 private:
  static constexpr double kGain = 0.05;
  static constexpr double kAnAxis = 0.849;  // 1 sigma an axis of a distance with the median 1 (Rayleigh)

  /// `least` of the distance when `sure` of the features and more find a corner, all of it when only `doubtful_support` do.
  [[nodiscard]] double of_distance(const Shown& s, double least, double sure) const {
    const double doubt = std::clamp((sure - s.support) / std::max(1e-9, sure - config_.doubtful_support), 0.0, 1.0);
    return s.residual_px * (least + (1 - least) * doubt);
  }

  const AlignConfig& config_;
  bool known_{false};
  Shown mean_;
};

}  // namespace cyclops::align
