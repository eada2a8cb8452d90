#pragma once
/// Turns, moves and scales all learnt points and poses together so that most surveyed features have a learnt point at their place.
///
/// The aligned poses share an error (features that are no corners pull them all the same way), and what is learnt from them
/// inherits it. But among themselves the learnt points fit within a tenth of a pixel or two, and some of them are surveyed
/// features. Every pair of a feature and a point near it votes for a small similarity; annealing the width of the votes finds the one
/// that most pairs agree on. Votes count across the line of sight, in pixels: depth is known less well.
/// Source   deterministic annealing of soft assignments: Rangarajan et al. 1997; here with a prior and small motions.
#include "tools/learn_types.hpp"

namespace cyclops::tools::learn {

struct AxesConfig {
  double pair_px{3.0};            ///< a feature and a point further apart than this, on average over the point's views, are no pair
  double first_px{1.5}, last_px{0.25};  ///< 1 sigma of a pair, at the beginning and the end of annealing
  double turn_rad{0.003};         ///< 1 sigma of what is to be found
  double shift_share{0.01};       ///< the same, as a share of the distance to the camera
  double scale{0.005};
  double agree_px{0.5};
  int least_agree{4};             ///< with fewer features nothing is moved
};

/// p' = scale R p + shift, k axes.
struct AxesChange {
  Vec3 turn_rad{0, 0, 0};
  Vec3 shift_m{0, 0, 0};
  double scale{1};
  int agree{0};                   ///< features with a point at their place afterwards
};

/// Works out the change; moves nothing.
AxesChange find_axes(const Views& views, const std::vector<LearntPoint>& points, const AxesConfig& config);

/// Every projection stays as it is.
void move_axes(const AxesChange& change, Views& views, std::vector<LearntPoint>& points);

/// Mean distance of a point from another place, in some of the point's views, px.
double mean_distance_px(const std::vector<View>& views, const LearntPoint& p, const Point<frame::K>& q);

}  // namespace cyclops::tools::learn
