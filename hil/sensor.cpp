#include "hil/sensor.hpp"

#include <algorithm>
#include <cmath>

#include "hil/noise.hpp"

namespace cyclops::hil {
namespace {

/// Frame transfer: each row passes under the light of its whole column.
void smear(std::vector<float>& e, int width, int height, float share) {
  std::vector<float> column(static_cast<std::size_t>(width));
  const auto n = static_cast<std::size_t>(width);
  for (int v = 0; v < height; ++v)
    for (std::size_t u = 0; u < n; ++u) column[u] += e[static_cast<std::size_t>(v) * n + u];
  for (int v = 0; v < height; ++v)
    for (std::size_t u = 0; u < n; ++u) e[static_cast<std::size_t>(v) * n + u] += share * column[u];
}

/// Charge above full well fills its neighbours up and down the column, losing half a percent a row.
void bloom(std::vector<float>& e, int width, int height, float well, float share) {
  const auto n = static_cast<std::size_t>(width);
  for (std::size_t u = 0; u < n; ++u) {
    bool over = false;
    for (int v = 0; v < height && !over; ++v) over = e[static_cast<std::size_t>(v) * n + u] > well;
    if (!over) continue;
    std::vector<float> spill(static_cast<std::size_t>(height));
    for (int v = 0; v < height; ++v) {
      float& x = e[static_cast<std::size_t>(v) * n + u];
      if (x > well) spill[static_cast<std::size_t>(v)] = 0.5F * share * (x - well), x = well;
    }
    for (const int way : {1, -1}) {
      float carried = 0;
      for (int v = way > 0 ? 0 : height - 1; v >= 0 && v < height; v += way) {
        float& x = e[static_cast<std::size_t>(v) * n + u];
        const float room = std::min(well - x, carried);
        x += room;
        carried = 0.995F * (carried - room) + spill[static_cast<std::size_t>(v)];
      }
    }
  }
}

}  // namespace

int saturated_count(const SensorLook& s) {
  const double full = std::min(s.full_well_e / s.electrons_per_count() + s.black_level * s.top_count(), 1.0 * s.top_count());
  return static_cast<int>(0.98 * full);
}

void expose(const Look& look, int width, int height, std::uint64_t seed, std::uint64_t frame, std::vector<float>& image, std::vector<std::uint16_t>& out) {
  const SensorLook& s = look.sensor;
  const auto per_cdm2 = static_cast<float>(s.responsivity * s.exposure_us * 1e-6 / (look.optics.f_number * look.optics.f_number));
  for (float& x : image) x = std::max(x, 0.F) * per_cdm2;
  const auto well = static_cast<float>(s.full_well_e);
  if (s.transfer_ms > 0) smear(image, width, height, static_cast<float>(s.transfer_ms * 1e3 / (s.exposure_us * height)));
  if (s.blooming > 0) bloom(image, width, height, well, static_cast<float>(s.blooming));
  const float* table = normal_table();
  const std::uint64_t noise = key(seed, 0x5EED, frame), own = key(seed, 0x9A1E);
  const auto per_count = static_cast<float>(1 / s.electrons_per_count()), read2 = static_cast<float>(s.read_noise_e * s.read_noise_e), prnu = static_cast<float>(s.prnu);
  const float photons = s.photon_noise ? 1.F : 0.F, black = static_cast<float>(s.black_level * s.top_count()) + 0.5F, top = static_cast<float>(s.top_count()) + 0.5F;
  out.resize(image.size());
  for (std::size_t i = 0; i < image.size(); i += 4) {
    const std::uint64_t bits = mixed(noise + i), fixed = mixed(own + i);  // four pixels of 16 bits each
    for (std::size_t k = 0; k < 4 && i + k < image.size(); ++k) {
      const float e = std::min(image[i + k] * (1 + prnu * table[fixed >> (16 * k) & 0xFFFF]), well);
      const float noisy = e + std::sqrt(photons * e + read2) * table[bits >> (16 * k) & 0xFFFF];
      out[i + k] = static_cast<std::uint16_t>(std::clamp(noisy * per_count + black, 0.F, top));
    }
  }
  for (int k = 0; k < s.dead_pixels; ++k) out[key(seed, 0xDEAD, static_cast<std::uint64_t>(k)) % out.size()] = 0;
}

}  // namespace cyclops::hil
