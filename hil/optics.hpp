#pragma once
/// What lens and windscreen do to luminance on the sensor, in place: blur, veiling glare, vignetting.
/// Threads  any.
#include <vector>

#include "hil/look.hpp"

namespace cyclops::hil {

/// `focal_px` scales the vignette: (1 + k r^2 / f^2)^-2 is cos^4 for k = 1.
void through_lens(const OpticsLook& look, int width, int height, double focal_px, std::vector<float>& image);

}  // namespace cyclops::hil
