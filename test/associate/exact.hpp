#pragma once
/// Two exact solvers to judge the auction by: try everything, and Kuhn-Munkres with potentials for larger cases.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cyclops::test {

/// gain[track][corner]; below 0 = forbidden. Leaving a track unmatched is worth 0.
using Gains = std::vector<std::vector<double>>;

/// Best total over all partial assignments, by sets of used corners; up to about 12 corners.
inline double best_by_trying_all(const Gains& gain, std::size_t corners) {
  std::vector<double> best(std::size_t{1} << corners, -1.0);
  best[0] = 0;
  for (const auto& row : gain) {
    auto next = best;
    for (std::size_t used = 0; used < best.size(); ++used)
      for (std::size_t j = 0; best[used] >= 0 && j < corners; ++j)
        if (row[j] >= 0 && (used >> j & 1U) == 0) next[used | std::size_t{1} << j] = std::max(next[used | std::size_t{1} << j], best[used] + row[j]);
    best = next;
  }
  return *std::max_element(best.begin(), best.end());
}

/// Best total by shortest augmenting paths; each track has one more column of its own that is worth 0.
inline double best_by_kuhn_munkres(const Gains& gain, std::size_t corners) {
  const std::size_t n = gain.size(), m = corners + n;
  const double inf = std::numeric_limits<double>::infinity();
  const auto cost = [&](std::size_t i, std::size_t j) { return j >= corners ? 0.0 : gain[i][j] >= 0 ? -gain[i][j] : 1e9; };
  std::vector<double> u(n + 1), v(m + 1);
  std::vector<std::size_t> row_of(m + 1), from(m + 1);
  for (std::size_t i = 1; i <= n; ++i) {
    row_of[0] = i;
    std::size_t j0 = 0;
    std::vector<double> least(m + 1, inf);
    std::vector<char> done(m + 1);
    do {
      done[j0] = 1;
      double delta = inf;
      std::size_t j1 = 0;
      for (std::size_t j = 1; j <= m; ++j) {
        if (done[j] != 0) continue;
        const double reduced = cost(row_of[j0] - 1, j - 1) - u[row_of[j0]] - v[j];
        if (reduced < least[j]) { least[j] = reduced; from[j] = j0; }
        if (least[j] < delta) { delta = least[j]; j1 = j; }
      }
      for (std::size_t j = 0; j <= m; ++j)
        if (done[j] != 0) { u[row_of[j]] += delta; v[j] -= delta; } else least[j] -= delta;
      j0 = j1;
    } while (row_of[j0] != 0);
    for (; j0 != 0; j0 = from[j0]) row_of[j0] = row_of[from[j0]];
  }
  double total = 0;
  for (std::size_t j = 1; j <= corners; ++j)
    if (row_of[j] != 0) total -= cost(row_of[j] - 1, j - 1);
  return total;
}

}  // namespace cyclops::test
