#pragma once
/// Which points the corners do not place on the tanker: taken out between two adjustments, or the next one has no covariance.
///
/// Outside        the adjustment moved the point off the tanker: something behind it, a reflection, dirt on the windscreen.
/// Undetermined   its sights, were all poses known, leave it free by more than the tanker is large: all from one direction.
///                Such a point runs off along its line of sight, and the normal equations lose a rank.
#include "tools/learn_bundle.hpp"

namespace cyclops::tools::learn {

/// Bounding box of the surveyed features, tanker body axes, m.
struct Extent {
  explicit Extent(const TankerModel& tanker);
  [[nodiscard]] double size() const { return (high - low).maxCoeff(); }
  [[nodiscard]] bool holds(const Vec3& p_k, double beyond_m) const;
  Vec3 low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
};

/// Largest 1 sigma of the place of a point, m, from its corners alone with the weights of the adjustment; infinite when a direction is free.
[[nodiscard]] double loosest_sigma_m(const BundleConfig& config, const std::vector<View>& views, const LearntPoint& point);

struct Sifted {
  int outside{0}, undetermined{0};
};

/// `beyond`: a point may lie outside the surveyed features by this share of their extent.
Sifted sift(const BundleConfig& config, double beyond, const Views& views, std::vector<LearntPoint>& points);

}  // namespace cyclops::tools::learn
