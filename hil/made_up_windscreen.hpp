#pragma once
/// A windscreen nobody built: smooth, a pixel or two in the middle and four at the edges, as spec 3.7 and 3.2.3 describe a real one.
///
/// `size` 1: mean shift 1.2 px, largest about 4 px on any picture; everything is proportional to it. 0: no windscreen.
/// Errors   none for sizes of a picture that a camera can have.
#include "geometry/windscreen.hpp"

namespace cyclops::hil {

[[nodiscard]] Result<Windscreen> made_up_windscreen(int width_px, int height_px, double size);

/// How far the windscreen moves a ray sideways, camera axes right and down, m: nothing in the middle, half of `parallax_mm` at the middle of an edge.
[[nodiscard]] Vec2 windscreen_parallax_m(const Vec2& raw_px, int width_px, int height_px, double parallax_mm);

/// What a calibration in front of a wall of targets makes of it (spec 3.7): the shift measured every `step_px` with an error of
/// `sigma_px` (1 sigma) an axis, bilinear in between. So it is not exactly right, least where the windscreen bends most.
/// `parallax_mm` and `range_m`: hil/look.hpp's key and the distance of the wall, seen with `focal_px`.
struct Calibration {
  double sigma_px{0.5};
  int step_px{96};
  double parallax_mm{0}, range_m{20}, focal_px{1041.67};
  std::uint64_t seed{1};
};
[[nodiscard]] Result<Windscreen> calibrated_windscreen(const Windscreen& exact, int width_px, int height_px, const Calibration& how);

}  // namespace cyclops::hil
