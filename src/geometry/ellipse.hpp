#pragma once
/// What a 2x2 covariance looks like.
#include <algorithm>
#include <cmath>

#include "geometry/frames.hpp"

namespace cyclops {

/// Larger half axis of the 1-sigma ellipse: square root of the larger eigenvalue.
[[nodiscard]] inline double larger_sigma(const Mat2& covariance) {
  const double mean = 0.5 * (covariance(0, 0) + covariance(1, 1));
  const double half = std::hypot(0.5 * (covariance(0, 0) - covariance(1, 1)), 0.5 * (covariance(0, 1) + covariance(1, 0)));
  return std::sqrt(std::max(0.0, mean + half));
}

}  // namespace cyclops
