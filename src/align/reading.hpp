#pragma once
/// Inside align: features with their candidates, and a reading (six pose errors and what supports them).
#include <cstdint>
#include <vector>

#include "geometry/frames.hpp"

namespace cyclops::align {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Jac = Eigen::Matrix<double, 2, 6>;

struct Seen {                 ///< one feature as predicted from the prior
  std::uint16_t feature{0};
  Vec2 uv{0, 0};              ///< raw px
  Jac J{Jac::Zero()};         ///< d uv / d [rotation about the tanker INS in c; translation in c]
  int first{0};               ///< candidates [first, first + count)
  int count{0};
  double R{1};                ///< variance of a corner about this feature, px^2 an axis
};

struct Problem {
  std::vector<Seen> seen;     ///< capacity reserved once
  std::vector<Vec2> corner;   ///< candidates of all features, px
  Mat6 P{Mat6::Identity()};   ///< prior covariance
  double log_gain{0};         ///< log( P_D / (2 pi lambda) )
};

struct Reading {
  Vec6 d{Vec6::Zero()};
  Mat6 P{Mat6::Identity()};
  double evidence{0};
  std::uint64_t used{0};      ///< bit i: seen[i] is part of it
};

inline constexpr std::size_t kMostUsed = 64;

/// Conditions the reading on feature `s` being at `z`.
void condition(Reading& reading, const Seen& s, const Vec2& z);

/// Evidence of the nearest candidate of one feature under a reading; 0 when clutter explains it as well.
double evidence_of(const Problem& problem, const Reading& reading, const Seen& s, int& candidate);

/// Sum over the features.
double evidence_of(const Problem& problem, const Reading& reading);

/// All one-point hypotheses, the best `keep` different ones first.
void one_point_readings(const Problem& problem, std::size_t use, std::size_t keep, std::vector<Reading>& out);

/// Adds the most telling feature, again and again, until none supports the reading or `most` were added; then rates it:
/// evidence of all features less the cost of leaving the prior.
void grow(const Problem& problem, std::size_t use, int most, Reading& reading);

/// Mean distance between the places two readings give the features, px.
double separation_px(const Problem& problem, const Reading& a, const Reading& b);

}  // namespace cyclops::align
