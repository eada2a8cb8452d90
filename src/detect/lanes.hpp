#pragma once
/// Eight floats at a time by the compiler's vector types. Without AVX the compiler splits them; the bits stay the same.
#include <cstring>

namespace cyclops::lanes {

inline constexpr int kLanes = 8;
using F8 = float __attribute__((vector_size(32)));
using I8 = int __attribute__((vector_size(32)));

inline F8 load(const float* p) {
  F8 v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store(float* p, F8 v) { std::memcpy(p, &v, sizeof v); }
inline F8 all(float x) { return F8{x, x, x, x, x, x, x, x}; }
inline F8 larger(F8 a, F8 b) { return a > b ? a : b; }
/// a * b + c, rounded once: the same bits with and without an instruction for it.
inline F8 multiply_add(F8 a, F8 b, F8 c) {
  F8 r{};
  for (int i = 0; i < kLanes; ++i) r[i] = __builtin_fmaf(a[i], b[i], c[i]);
  return r;
}
/// In a fixed order, so that every build adds alike.
inline float sum(F8 v) { return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])); }

/// Bit i is lane i of a comparison's result.
inline unsigned bits(I8 m) {
#ifdef __AVX__
  return static_cast<unsigned>(__builtin_ia32_movmskps256(reinterpret_cast<F8>(m)));
#else
  unsigned b = 0;
  for (int i = 0; i < kLanes; ++i) b |= (m[i] != 0 ? 1U : 0U) << i;
  return b;
#endif
}

constexpr int round_up(int n) { return (n + kLanes - 1) / kLanes * kLanes; }

}  // namespace cyclops::lanes
