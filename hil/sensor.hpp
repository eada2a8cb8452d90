#pragma once
/// From luminance to counts: electrons, smear, blooming, full well, noise, quantisation, dead pixels. In that order.
///
/// Model    EMVA 1288 linear: DN = floor(e / K + black + 1/2), e of variance (photons + read noise^2).
/// Repeats  a function of (seed, frame, pixel). Threads: any.
#include <cstdint>
#include <vector>

#include "hil/look.hpp"

namespace cyclops::hil {

/// `image`: cd/m2 on the sensor, used up. `out`: width x height counts.
void expose(const Look& look, int width, int height, std::uint64_t seed, std::uint64_t frame, std::vector<float>& image, std::vector<std::uint16_t>& out);

/// Counts from which a pixel is taken for saturated.
[[nodiscard]] int saturated_count(const SensorLook& look);

}  // namespace cyclops::hil
