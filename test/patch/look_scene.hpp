#pragma once
/// A plate with soft blots, nothing a corner detector would find a corner in, and looks of its features.
#include <gtest/gtest.h>

#include <cmath>

#include <memory>

#include "patch/looks.hpp"
#include "patch/patch_matcher.hpp"
#include "patch/patch_search.hpp"
#include "test/plate.hpp"

namespace cyclops::test {

inline double blots(double y, double z) { return 120 + 45 * std::sin(5.1 * y + 2 * std::sin(3 * z)) + 35 * std::cos(4.3 * z - 1.7 * y); }
/// Finer: 7 px from light to dark at 9 m.
inline double grain(double y, double z) { return 120 + 45 * std::sin(14 * y + 2 * std::sin(8 * z)) + 35 * std::cos(12 * z - 5 * y); }
inline double dark(double, double) { return 60; }

struct LookScene {
  Plate plate;
  /// Pose of frame n: the plate drifts, turns and comes nearer.
  static CameraPose truth(int n) { return Plate::pose({0.1 + 0.002 * n, -0.1, 0.05 + 0.004 * n}, {0.02 * n, -0.1, 9 - 0.03 * n}); }

  /// Of the true pose of frame n, in whole counts.
  Look look(std::size_t feature, int n, const Paint& paint = grain) {
    const ImageView image = plate.draw(truth(n), paint, dark, 1);
    Look l;
    l.feature = feature;
    l.id = plate.model.features()[feature].id;
    l.p_k = plate.model.in_body(plate.model.features()[feature]);
    l.light = "drawn";
    EXPECT_TRUE(PatchSearch({}, plate.camera).take(image, nullptr, truth(n), l.p_k, plate.at(truth(n), feature), l.patch));
    l.tried = 30;
    l.matched = 29;
    l.scatter_px = 0.1;
    l.anchor_px = 0.125;
    l.correlation = 0.96875;
    return l;
  }
};

/// Frames of a plate before a matcher whose group agrees on a pose.
class MatcherTest : public ::testing::Test {
 protected:
  void show(PatchMatcher& matcher, Plate& plate, const CameraPose& truth, const CameraPose& agreed, const Paint& paint, double sigma_px, std::uint64_t noise) {
    image = plate.draw(truth, paint, dark, noise);
    alignment.consensus = true;
    alignment.inliers = alignment.considered = 6;
    alignment.T_c_k = agreed;
    plate.predict(agreed, sigma_px, *aligned);
    corners->items.clear();
    matcher.find(image, nullptr, alignment, *aligned);
    matcher.measure(image, nullptr, alignment, *aligned, *corners);
  }
  const Corner* of(int feature) const {
    for (const Corner& c : corners->items)
      if (c.feature == feature) return &c;
    return nullptr;
  }

  ImageView image;
  Alignment alignment;
  std::unique_ptr<PredictionSet> aligned = std::make_unique<PredictionSet>();
  std::unique_ptr<CornerSet> corners = std::make_unique<CornerSet>();
};

}  // namespace cyclops::test
