#pragma once
/// A square of picture around a feature, and from where it was taken.
///
/// Frames   raw pixels; camera from tanker body. Plain data.
#include <array>

#include "geometry/frames.hpp"

namespace cyclops {

struct StoredPatch {
  static constexpr int kHalf = 18, kSide = 2 * kHalf + 1;
  Pose<frame::C, frame::K> T_c_k{};           ///< when it was taken
  Vec2 inside_px{0, 0};                       ///< the feature, from the middle of the square
  double step_m{0};                           ///< a step across the line of sight at the feature, and
  Mat2 then_px{Mat2::Zero()};                 ///< where such a step to the right and one down went in that picture, as columns; zero: not known
  std::array<float, kSide * kSide> store{};   ///< brightness, row by row
};

}  // namespace cyclops
