#pragma once
/// The inner loops of the corner kernel, each over one row. Counts are rounded up to whole vectors by the caller, who owns
/// the room behind the last column. `Half` and `Radius` are template arguments so that the loops over them unroll.
#include <cstdint>

#include "detect/corner_kernel.hpp"
#include "detect/lanes.hpp"

namespace cyclops::rows {

using lanes::F8;
using lanes::kLanes;
using lanes::larger;
using lanes::load;
using lanes::store;

/// Pixels to float. Whole blocks vectorise; the last block overlaps the one before instead of going pixel by pixel.
template <class Pixel>
void to_float(const Pixel* __restrict in, int n, float* __restrict out) {
  constexpr int kBlock = 32;
  int i = 0;
  for (; i + kBlock <= n; i += kBlock)
    for (int k = 0; k < kBlock; ++k) out[i + k] = static_cast<float>(in[i + k]);
  if (i == n) return;
  if (n < kBlock) {
    for (; i < n; ++i) out[i] = static_cast<float>(in[i]);
  } else {
    i = n - kBlock;
    for (int k = 0; k < kBlock; ++k) out[i + k] = static_cast<float>(in[i + k]);
  }
}

/// Central differences of three pixel rows and their products. Column i of the output is pixel i + 1.
inline void products(const float* __restrict up, const float* __restrict mid, const float* __restrict down, int n,
                     float* __restrict xx, float* __restrict yy, float* __restrict xy) {
  for (int i = 0; i < n; i += kLanes) {
    const F8 x = load(mid + i + 2) - load(mid + i), y = load(down + i + 1) - load(up + i + 1);
    store(xx + i, x * x);
    store(yy + i, y * y);
    store(xy + i, x * y);
  }
}

/// w along a row or across rows: the centre, then pairs outwards. `at(k)` is the vector k steps from the centre.
template <int Half, class At>
inline F8 weighted(const F8* weight, At&& at) {
  F8 sum = weight[0] * at(0);
  for (int k = 1; k <= Half; ++k) sum += weight[k] * (at(-k) + at(k));
  return sum;
}

template <int Half>
struct Weights {
  explicit Weights(const float* weight) {
    for (int k = 0; k <= Half; ++k) w[k] = lanes::all(weight[k]);
  }
  F8 w[Half + 1];
};

/// Products of 2 Half + 1 rows, oldest first; the three kinds lie kRow floats apart.
template <int Half>
void weigh_down(const float* weight, const float* const* rows, int n, float* __restrict out) {
  constexpr int kKind = CornerKernel::kRow;
  const Weights<Half> g(weight);
  const float* r[2 * Half + 1];
  for (int k = 0; k <= 2 * Half; ++k) r[k] = rows[k];
  for (int i = 0; i < n; i += kLanes)
    for (int kind = 0; kind < 3; ++kind)
      store(out + kind * kKind + i, weighted<Half>(g.w, [&](int k) { return load(r[Half + k] + kind * kKind + i); }));
}

/// Across the row, then Noble's measure. Column i of the output is column i + Half of the input.
template <int Half>
void weigh_across(const float* weight, const float* __restrict in, float eps, int n, float* __restrict out) {
  constexpr int kKind = CornerKernel::kRow;
  const Weights<Half> g(weight);
  for (int i = 0; i < n; i += kLanes) {
    const auto across = [&](int kind) { return weighted<Half>(g.w, [&](int k) { return load(in + kind * kKind + i + Half + k); }); };
    const F8 a = across(0), b = across(1), c = across(2);
    store(out + i, (a * b - c * c) / (a + b + lanes::all(eps)));
  }
}

inline double sum(const float* p, int n) {
  F8 s = lanes::all(0);
  int i = 0;
  for (; i + kLanes <= n; i += kLanes) s += load(p + i);
  float rest = lanes::sum(s);
  for (; i < n; ++i) rest += p[i];
  return static_cast<double>(rest);
}

/// Largest of the Radius values before index i.
template <int Radius>
inline F8 largest_before(const float* x, int i) {
  F8 m = load(x + i - 1);
  for (int k = 2; k <= Radius; ++k) m = larger(m, load(x + i - k));
  return m;
}

/// out[i] = largest of x[i - Radius .. i + Radius]
template <int Radius>
void largest_around(const float* __restrict x, int n, float* __restrict out) {
  for (int i = 0; i < n; i += kLanes) {
    F8 m = larger(largest_before<Radius>(x, i), load(x + i));
    for (int k = 1; k <= Radius; ++k) m = larger(m, load(x + i + k));
    store(out + i, m);
  }
}

/// Writes each i in [begin, end) where x is larger than everything before it in its square, rows above first, and no smaller
/// than everything after it; returns how many. `around`: largest_around of 2 Radius + 1 rows, x's own in the middle.
template <int Radius>
int maxima(const float* x, const float* const* around, int begin, int end, int* __restrict found) {
  const float* a[2 * Radius + 1];
  for (int k = 0; k <= 2 * Radius; ++k) a[k] = around[k];
  int n = 0;
  for (int i = begin; i < end; i += kLanes) {
    F8 earlier = largest_before<Radius>(x, i), later = load(a[Radius] + i);
    for (int k = 0; k < Radius; ++k) {
      earlier = larger(earlier, load(a[k] + i));
      later = larger(later, load(a[Radius + 1 + k] + i));
    }
    const F8 centre = load(x + i);
    for (unsigned hits = lanes::bits((centre > earlier) & (centre >= later)); hits != 0; hits &= hits - 1)
      found[n++] = i + __builtin_ctz(hits);
  }
  while (n > 0 && found[n - 1] >= end) --n;
  return n;
}

}  // namespace cyclops::rows
