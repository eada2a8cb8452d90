#pragma once
/// A number in [0, 1) that depends on its input only: chance that is the same again for the same seed, on any thread.
#include <cstdint>

namespace cyclops::hil {

/// Source  S. Vigna, splitmix64, the finaliser.
[[nodiscard]] inline double dice(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

}  // namespace cyclops::hil
