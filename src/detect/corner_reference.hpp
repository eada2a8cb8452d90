#pragma once
/// The corner kernel once more, one pixel at a time and with the whole rectangle in memory: what the fast one must equal.
/// With Real = float it gives the same bits; with double it is what worked examples are checked against.
/// Allocates. Source: spec 2.4, as corner_kernel.hpp.
#include <vector>

#include "detect/corner_kernel.hpp"

namespace cyclops {

/// Rc over job.measure, row-major. Explicit for float and double.
template <class Real>
[[nodiscard]] std::vector<Real> reference_measure(const KernelJob& job, int gaussian_size, double gaussian_sigma_px, double eps);

/// Maxima of a measure over job.search, in raster order, by the definition in corner_kernel.hpp.
[[nodiscard]] std::vector<Peak> reference_maxima(const KernelJob& job, const std::vector<float>& measure, int radius);

}  // namespace cyclops
