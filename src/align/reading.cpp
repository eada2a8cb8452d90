#include "align/reading.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/result.hpp"

namespace cyclops::align {
namespace {

constexpr double kGate = 9.2;       // squared Mahalanobis, 2 dof, 99 %
constexpr double kSame_px = 2.5;    // closer readings are one

/// Evidence of the candidate nearest to `mean` with innovation covariance S.
double best_candidate(const Problem& problem, const Seen& s, const Vec2& mean, const Mat2& S, int& candidate) {
  candidate = -1;
  const double det = S.determinant();
  const double ceiling = problem.log_gain - 0.5 * std::log(det);
  if (ceiling <= 0) return 0;
  const double a = S(1, 1) / det, b = -S(0, 1) / det, c = S(0, 0) / det;
  double least = std::min(kGate, 2 * ceiling);
  for (int i = s.first; i < s.first + s.count; ++i) {
    const double x = problem.corner[static_cast<std::size_t>(i)].x() - mean.x();
    const double y = problem.corner[static_cast<std::size_t>(i)].y() - mean.y();
    const double m = a * x * x + 2 * b * x * y + c * y * y;
    if (m < least) {
      least = m;
      candidate = i;
    }
  }
  return candidate < 0 ? 0 : ceiling - 0.5 * least;
}

void keep_if_new(const Problem& problem, std::size_t keep, const Reading& r, std::vector<Reading>& out) {
  if (out.size() == keep && r.evidence <= out.back().evidence) return;
  for (std::size_t i = 0; i < out.size(); ++i)
    if (separation_px(problem, out[i], r) < kSame_px) {
      if (r.evidence <= out[i].evidence) return;
      out.erase(out.begin() + static_cast<std::ptrdiff_t>(i));
      break;
    }
  if (out.size() == keep) out.pop_back();
  const auto at = std::find_if(out.begin(), out.end(), [&](const Reading& o) { return r.evidence > o.evidence; });
  out.insert(at, r);
}

}  // namespace

void condition(Reading& reading, const Seen& s, const Vec2& z) {
  const Eigen::Matrix<double, 6, 2> PJt = reading.P * s.J.transpose();
  const Mat2 S = s.J * PJt + s.R * Mat2::Identity();
  const Eigen::Matrix<double, 6, 2> K = PJt * S.inverse();
  reading.d += K * (z - s.uv - s.J * reading.d);
  reading.P -= K * PJt.transpose();
  reading.P = 0.5 * (reading.P + reading.P.transpose().eval());
}

double evidence_of(const Problem& problem, const Reading& reading, const Seen& s, int& candidate) {
  const Mat2 S = s.J * reading.P * s.J.transpose() + s.R * Mat2::Identity();
  return best_candidate(problem, s, s.uv + s.J * reading.d, S, candidate);
}

double evidence_of(const Problem& problem, const Reading& reading) {
  double sum = 0;
  int unused = 0;
  for (const Seen& s : problem.seen) sum += evidence_of(problem, reading, s, unused);
  return sum;
}

double separation_px(const Problem& problem, const Reading& a, const Reading& b) {
  if (problem.seen.empty()) return 0;
  const Vec6 d = a.d - b.d;
  double sum = 0;
  const std::size_t step = 1 + problem.seen.size() / 12;
  std::size_t n = 0;
  for (std::size_t i = 0; i < problem.seen.size(); i += step, ++n) sum += (problem.seen[i].J * d).norm();
  return sum / static_cast<double>(n);
}

void one_point_readings(const Problem& problem, std::size_t use, std::size_t keep, std::vector<Reading>& out) {
  out.clear();
  const std::size_t n = std::min(use, problem.seen.size());
  struct Given {  // feature j once feature i is known
    Mat2 shift;   // displacement of j for a displacement of i
    Mat2 S;
  };
  std::array<Given, kMostUsed> given;
  CYCLOPS_ASSERT(n <= given.size());
  for (std::size_t i = 0; i < n; ++i) {
    const Seen& si = problem.seen[i];
    const Eigen::Matrix<double, 6, 2> PJt = problem.P * si.J.transpose();
    const Mat2 Si = (si.J * PJt + si.R * Mat2::Identity()).inverse();
    const Eigen::Matrix<double, 6, 2> K = PJt * Si;
    const Mat6 Pi = problem.P - K * PJt.transpose();
    for (std::size_t j = 0; j < n; ++j) {
      const Seen& sj = problem.seen[j];
      given[j].shift = sj.J * K;
      given[j].S = sj.J * Pi * sj.J.transpose() + sj.R * Mat2::Identity();
    }
    for (int c = si.first; c < si.first + si.count; ++c) {
      const Vec2 r = problem.corner[static_cast<std::size_t>(c)] - si.uv;
      Reading reading;
      reading.evidence = -0.5 * r.dot(Si * r);
      int unused = 0;
      for (std::size_t j = 0; j < n; ++j)
        reading.evidence += best_candidate(problem, problem.seen[j], problem.seen[j].uv + given[j].shift * r, given[j].S, unused);
      if (out.size() == keep && reading.evidence <= out.back().evidence) continue;
      reading.d = K * r;
      reading.P = Pi;
      reading.used = std::uint64_t{1} << i;
      keep_if_new(problem, keep, reading, out);
    }
  }
}

void grow(const Problem& problem, std::size_t use, int most, Reading& reading) {
  const std::size_t n = std::min({use, problem.seen.size(), kMostUsed});
  for (int added = 0; added < most; ++added) {
    double best = 0;
    std::size_t best_i = n;
    int best_c = -1;
    for (std::size_t i = 0; i < n; ++i) {
      if ((reading.used >> i & 1U) != 0) continue;
      int c = -1;
      const double e = evidence_of(problem, reading, problem.seen[i], c);
      if (e > best) {
        best = e;
        best_i = i;
        best_c = c;
      }
    }
    if (best_i == n) break;
    reading.used |= std::uint64_t{1} << best_i;
    condition(reading, problem.seen[best_i], problem.corner[static_cast<std::size_t>(best_c)]);
  }
  reading.evidence = evidence_of(problem, reading) - 0.5 * reading.d.dot(problem.P.ldlt().solve(reading.d));
}

}  // namespace cyclops::align
