#pragma once
/// Where straight edges meet in an image: the measurement of rendered corners. Knows no camera and no projection.
///
/// Method   a junction is an apex, two to four rays from it and an even level in each sector between them; a pixel has the exact shares of
///          its area. Apex and rays by damped least squares over a square window, levels in closed form. The fewest rays that do are taken.
/// Accepted rms misfit below 2 % of the contrast (8 x 8 samples a pixel leave up to 1.5 %), apex well inside the window, its standard error, from the misfit, below 0.06 px, and
///          a straight edge in place of two rays at least three times as bad: a corner of nearly 180 deg has no certain apex.
/// Units    pixels of the image, (0, 0) in the middle of the first. Threads any.
#include <optional>
#include <vector>

#include "geometry/frames.hpp"

namespace cyclops::hil {

struct Junction {
  Vec2 apex_px{0, 0};
  int rays{0};
  double misfit{0};    ///< rms over the contrast
  double sigma_px{0};  ///< standard error of the apex along its worse direction
};

/// The junction in the window of 2 reach + 1 pixels about `guess`; nothing when none fits, or the window leaves the image.
[[nodiscard]] std::optional<Junction> fit_junction(const std::vector<float>& image, int width, int height, const Vec2& guess, int reach = 6, int most_rays = 4);

}  // namespace cyclops::hil
