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
inline F8 weighted(const float* weight, At&& at) {
  F8 sum = lanes::all(weight[0]) * at(0);
  for (int k = 1; k <= Half; ++k) sum += lanes::all(weight[k]) * (at(-k) + at(k));
  return sum;
}

/// Products of 2 Half + 1 rows, `row[Half]` in the middle; the three kinds lie `stride` floats apart.
template <int Half>
void weigh_down(const float* weight, const float* const* row, int stride, int n, float* __restrict out) {
  const float* r[2 * Half + 1];
  for (int k = 0; k <= 2 * Half; ++k) r[k] = row[k];
  for (int i = 0; i < n; i += kLanes)
    for (int kind = 0; kind < 3; ++kind)
      store(out + kind * stride + i, weighted<Half>(weight, [&](int k) { return load(r[Half + k] + kind * stride + i); }));
}

/// Across the row, then Noble's measure. Column i of the output is column i + Half of the input.
template <int Half>
void weigh_across(const float* weight, const float* __restrict in, int stride, float eps, int n, float* __restrict out) {
  for (int i = 0; i < n; i += kLanes) {
    F8 s[3];
    for (int kind = 0; kind < 3; ++kind)
      s[kind] = weighted<Half>(weight, [&](int k) { return load(in + kind * stride + i + Half + k); });
    store(out + i, (s[0] * s[1] - s[2] * s[2]) / (s[0] + s[1] + lanes::all(eps)));
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

/// before[i] = largest of x[i - Radius .. i - 1]
template <int Radius>
void largest_before(const float* __restrict x, int n, float* __restrict before) {
  for (int i = 0; i < n; i += kLanes) {
    F8 m = load(x + i - 1);
    for (int k = 2; k <= Radius; ++k) m = larger(m, load(x + i - k));
    store(before + i, m);
  }
}

/// around[i] = largest of x[i - Radius .. i + Radius]
template <int Radius>
void largest_around(const float* __restrict x, const float* __restrict before, int n, float* __restrict around) {
  for (int i = 0; i < n; i += kLanes) store(around + i, larger(larger(load(before + i), load(before + i + Radius + 1)), load(x + i)));
}

/// Calls found(i) for each i in [begin, end) where x is larger than everything before it in its square, rows above first,
/// and no smaller than everything after it. `around[Radius]` is not looked at: that is x's own row.
template <int Radius, class Found>
void maxima(const float* x, const float* before, const float* const* around, int begin, int end, Found&& found) {
  const float* a[2 * Radius + 1];
  for (int k = 0; k <= 2 * Radius; ++k) a[k] = around[k];
  for (int i = begin; i < end; i += kLanes) {
    F8 earlier = load(before + i), later = load(before + i + Radius + 1);
    for (int k = 0; k < Radius; ++k) {
      earlier = larger(earlier, load(a[k] + i));
      later = larger(later, load(a[Radius + 1 + k] + i));
    }
    const F8 centre = load(x + i);
    unsigned hits = lanes::bits((centre > earlier) & (centre >= later));
    if (end - i < kLanes) hits &= (1U << (end - i)) - 1;
    for (; hits != 0; hits &= hits - 1) found(i + __builtin_ctz(hits));
  }
}

/// Calls f.template operator()<N>() for the run-time n in 1..Max.
template <int Max, class F>
void with_constant(int n, F&& f) {
  if constexpr (Max > 0) {
    if (n == Max) return f.template operator()<Max>();
    with_constant<Max - 1>(n, f);
  }
}

}  // namespace cyclops::rows
