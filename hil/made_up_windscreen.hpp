#pragma once
/// A windscreen nobody built: smooth, a pixel or two in the middle and four at the edges, as spec 3.7 and 3.2.3 describe a real one.
///
/// `size` 1: mean shift 1.2 px, largest about 4 px on any picture; everything is proportional to it. 0: no windscreen.
/// Errors   none for sizes of a picture that a camera can have.
#include "geometry/windscreen.hpp"

namespace cyclops::hil {

[[nodiscard]] Result<Windscreen> made_up_windscreen(int width_px, int height_px, double size);

}  // namespace cyclops::hil
