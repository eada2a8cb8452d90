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
  for (int k = 1; k <= Half; ++k) sum = lanes::multiply_add(weight[k], at(-k) + at(k), sum);
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
  for (int i = 0; i < n; i += kLanes) {
    const auto down = [&](int kind) { store(out + kind + i, weighted<Half>(g.w, [&](int k) { return load(r[Half + k] + kind + i); })); };
    down(0);
    down(kKind);
    down(2 * kKind);
  }
}

/// Across the row, then Noble's measure. Column i of the output is column i + Half of the input.
template <int Half>
void weigh_across(const float* weight, const float* __restrict in, float eps, int n, float* __restrict out) {
  constexpr int kKind = CornerKernel::kRow;
  const Weights<Half> g(weight);
  for (int i = 0; i < n; i += kLanes) {
    const auto across = [&](int kind) { return weighted<Half>(g.w, [&](int k) { return load(in + kind + i + Half + k); }); };
    const F8 a = across(0), b = across(kKind), c = across(2 * kKind);
    store(out + i, lanes::multiply_add(-c, c, a * b) / (a + b + lanes::all(eps)));
  }
}

/// Sum of n values; reads up to a whole vector behind them.
inline double sum(const float* p, int n) {
  F8 s = lanes::all(0);
  int i = 0;
  for (; i + kLanes <= n; i += kLanes) s += load(p + i);
  const lanes::I8 lane = {0, 1, 2, 3, 4, 5, 6, 7};
  s += lane < n - i ? load(p + i) : lanes::all(0);
  return static_cast<double>(lanes::sum(s));
}

// The largest value of a square of 2 Radius + 1 is found from runs of Radius, each used twice: what follows one pixel comes
// before another one.

/// out[i] = largest of x[i .. i + Radius - 1]
template <int Radius>
void largest_run(const float* __restrict x, int n, float* __restrict out) {
  for (int i = 0; i < n; i += kLanes) {
    F8 m = load(x + i);
    for (int k = 1; k < Radius; ++k) m = larger(m, load(x + i + k));
    store(out + i, m);
  }
}

/// around[i] = largest of x[i - Radius .. i + Radius], the last of `rows`; stack[i] = largest of all Radius rows.
template <int Radius>
void largest_around(const float* __restrict x, const float* __restrict run, int n, float* const* rows, float* __restrict stack) {
  const float* r[Radius];
  for (int k = 0; k < Radius; ++k) r[k] = rows[k];
  float* __restrict around = rows[Radius - 1];
  for (int i = 0; i < n; i += kLanes) {
    F8 m = larger(larger(load(run + i - Radius), load(x + i)), load(run + i + 1));
    store(around + i, m);
    for (int k = 0; k < Radius - 1; ++k) m = larger(m, load(r[k] + i));
    store(stack + i, m);
  }
}

/// Writes each i in [begin, end) where x is larger than everything before it in its square, rows above first, and no smaller
/// than everything after it; returns how many. `above`, `below`: stacks of the Radius rows there. Whether eight columns hold
/// a maximum cannot be foretold, so 64 are asked before the first branch depends on the answer.
template <int Radius>
int maxima(const float* x, const float* run, const float* above, const float* below, int begin, int end, int* __restrict found) {
  constexpr int kBlock = 64;
  int n = 0;
  for (int block = begin; block < end; block += kBlock) {
    const int columns = end - block < kBlock ? end - block : kBlock;
    std::uint64_t hits = 0;
    for (int k = 0; k < columns; k += kLanes) {
      const int i = block + k;
      const F8 earlier = larger(load(above + i), load(run + i - Radius)), later = larger(load(below + i), load(run + i + 1));
      const F8 centre = load(x + i);
      hits |= static_cast<std::uint64_t>(lanes::bits((centre > earlier) & (centre >= later))) << k;
    }
    for (hits &= ~std::uint64_t{0} >> (kBlock - columns); hits != 0; hits &= hits - 1) found[n++] = block + __builtin_ctzll(hits);
  }
  return n;
}

}  // namespace cyclops::rows
