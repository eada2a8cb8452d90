#pragma once
/// Which learnt points are worth keeping: found wherever they should be, in the same place from every side.
///
/// Scatter    robust rms of the residuals: how well one corner tells the place.
/// Drift      means over stretches of time, less what scatter alone would leave: a crossing of two outlines at different depth,
///            a shadow or a highlight slides over the tanker as the view turns, and shows it here.
/// Sector     directions and ranges from which a point was seen. Ranges at which it is mostly missed are cut off.
/// Strength   share of the views in its sector in which it was found.
/// Inflation  neighbouring views share errors (the same pixels, the same light), so the covariance that takes them as independent
///            is too small: times the chi-square of the means of stretches per degree of freedom.
#include "tools/learn_types.hpp"

namespace cyclops::tools::learn {

struct ChooseConfig {
  int least_sights{15};
  double least_strength{0.6};
  double most_scatter_px{0.5};
  double most_drift_px{0.4};
  double most_sigma_px{0.5};     ///< of the place itself, seen from the middle of its views, an axis
  double apart_px{6};            ///< two points, in the views of the stronger
  int most_points{80};
  double sector_margin_deg{8};   ///< a point is predicted this far beyond the directions it was seen from
  double range_margin{1.25};     ///< and beyond the ranges
};

/// How often and how well a point was found, in one range of distances of one flight.
struct Strength {
  int flight{0};
  double least_m{0}, most_m{0};
  int expected{0}, found{0};
  double rms_px{0};
};

struct ChosenPoint {
  LearntPoint point;
  SeenFrom seen_from;            ///< model axes, margins included
  std::vector<Strength> strength;
};

/// Fills scatter_px, drift_px and inflation from the residuals of the sights.
void rate(const std::vector<View>& views, LearntPoint& point);

/// The sector without margins; fills `strength` of the point.
SeenFrom sector_of(const std::vector<View>& views, LearntPoint& point);

/// How many points were left out, and why: the first reason that holds.
struct Refused {
  int few{0}, scatter{0}, drift{0}, weak{0}, uncertain{0}, near{0};
};

/// The best of the points, no two too near to each other. `points` are rated.
std::vector<ChosenPoint> choose(const ChooseConfig& config, const std::vector<View>& views, const std::vector<LearntPoint>& points, Refused* refused = nullptr);

}  // namespace cyclops::tools::learn
