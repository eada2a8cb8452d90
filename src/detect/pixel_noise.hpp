#pragma once
/// How noisy the pixels of a part of the image are, without knowing the scene.
///
/// |N| with N = [1 -2 1; -2 4 -2; 1 -2 1] * I answers neither to slopes nor to straight horizontal or vertical edges. Its
/// median over the part, divided by 0.6745 * 6, is the standard deviation of white noise, and what little of the part is
/// texture does not move it. At most some 16 000 pixels, whole rows, are looked at.
///
/// Units    counts^2; at least 1/12, the rounding to whole counts.
/// Threads  any; no heap.
/// Source   mask: Immerkaer 1996; the median instead of the mean is ours.
#include "detect/corner_kernel.hpp"

namespace cyclops {

/// Variance of one pixel in `part`, which lies inside the image. 1/12 when too small (under 3x3) or all rows are missing.
[[nodiscard]] double estimate_noise_variance(const ImageView& image, const PixelRect& part, const RowMask* missing);

}  // namespace cyclops
