#pragma once
/// Random numbers that are a function of where they are used: the same seed gives the same bits in any order of calls.
/// Threads  any. Memory: none, but for one table made at first use.
#include <cstdint>

namespace cyclops::hil {

[[nodiscard]] inline std::uint64_t mixed(std::uint64_t x) {  // finaliser of splitmix64
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}
[[nodiscard]] inline std::uint64_t key(std::uint64_t seed, std::uint64_t a, std::uint64_t b = 0) { return mixed(mixed(seed ^ mixed(a)) + b); }
/// 0 <= x < 1.
[[nodiscard]] inline double uniform(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }
/// 65536 equally likely quantiles of the standard normal distribution; index with 16 random bits.
[[nodiscard]] const float* normal_table();
/// Standard normal, from two uniforms.
[[nodiscard]] double normal(std::uint64_t bits);
/// Smooth value noise in the plane, octaves halving in size and weight; about 0..1.
[[nodiscard]] double fbm(double x, double y, int octaves, std::uint64_t seed);

}  // namespace cyclops::hil
