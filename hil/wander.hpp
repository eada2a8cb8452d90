#pragma once
/// Small unwanted motion of an aircraft: a stationary random function of time made of many sines, so that it is smooth and
/// can be asked at any time in any order.
///
/// Spectrum  gusts through an aircraft that swings at `frequency_hz` with `damping`: white noise, limited to `band_hz` from
///           below and above, through a second-order system. 48 sines with amplitudes from the spectrum and drawn phases.
/// Size      the expected variance is sigma^2. Threads: const use from any. Repeatable: a function of the seed.
/// Source    spectral representation of a random process, Shinozuka and Jan 1972; second-order modes as in any book on
///           flight dynamics (short period, Dutch roll, the pilot's position loop).
#include <array>
#include <cstdint>

namespace cyclops::hil {

struct WanderShape {
  double sigma{0};
  double frequency_hz{0.15};
  double damping{0.5};
};

class Wander {
 public:
  Wander() = default;
  Wander(const WanderShape& shape, std::uint64_t seed);
  [[nodiscard]] double at(double t_s) const;

 private:
  struct Sine { double amplitude{0}, rate_rps{0}, phase{0}; };
  std::array<Sine, 48> sines_{};
};

}  // namespace cyclops::hil
