#pragma once
/// How the surroundings of each feature have looked, and where they are now.
///
/// Most surveyed points are no corners of the image: a hinge, the end of a gap, a thin trailing edge. What surrounds them can
/// still be found again. While the group of all features is aligned, each feature's surroundings are remembered at its aligned
/// place; in later frames they are turned and scaled as the pose says, and looked for near the new aligned place.
///
/// Anchor   the mean of matched less aligned place over the frames since the patch was taken is removed, so that a match
///          tells where the feature is and not what error the pose had in one frame.
/// Holds    patches that have long been steady hold the pose: they are looked for from the pose of the corners, and where they are found
///          says what that pose has drifted by since (Aligner::hold). Anchors are learnt from the pose of the corners alone, so that the
///          mean of many frames rules in the end, and no pose confirms itself.
/// Certain  as the match and the aligned prediction are, and a share of the variance with which matches wander about the anchor, not
///          below a floor.
/// Steady   surroundings that belong to something else, before or behind, slide against the feature as the view turns: a patch
///          is used only while its place wanders little about its anchor.
/// Anew     a patch is taken again when the view has turned or the scale has changed too far, at the place that the old
///          one and its anchor give.
/// Learnt   a feature may have looks from earlier flights (patch/look_matcher.hpp). They stand in while its own patch is not known or not
///          steady. The looks of a learnt feature were adjusted together with its place: they come first where they are the more certain.
/// Frames   raw pixels. Time: that of the frame. Threads: one at a time. Memory: everything on construction. Deterministic.
/// Source   patch/patch_search.hpp for the match; anchor and use are ours.
#include <vector>

#include "geometry/tanker_model.hpp"
#include "patch/look_matcher.hpp"
#include "patch/patch_search.hpp"

namespace cyclops {

class PatchMatcher {
 public:
  /// `camera` and `looks` must outlive it.
  PatchMatcher(const PatchConfig& config, const TankerModel& model, const Camera& camera, const Looks& looks = {});

  /// Looks for each visible feature's own patch, and learns how it lies. `aligned` holds one prediction a feature, at the pose of
  /// `alignment`, that of the corners, or with by_landmarks one that is expected: then anchors are not learnt. Before measure; without
  /// consensus nothing is found.
  void find(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned);

  /// Of the last find: the places by patches that may hold the pose.
  [[nodiscard]] const LandmarkSet& landmarks() const { return landmarks_; }

  /// Appends the place of each visible feature that was found again to `corners`, looks for the learnt looks, and takes patches anew.
  /// `aligned`: at the final pose of the frame. Without consensus nothing happens.
  void measure(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned, CornerSet& corners);

  void reset();

 private:
  struct Patch {
    bool known{false};
    bool found{false};                    // in this frame
    Vec2 place_px{0, 0};                  // if found: of the feature
    Mat2 match_cov_px2{Mat2::Identity()};
    StoredPatch stored{};
    Vec2 offset_px{0, 0};                 // mean of matched less aligned place
    double frames{0};
    double wander2{0};                    // mean square of match less anchor, px^2 an axis
    int misses{0};                        // in a row
  };

  void lapse();
  static void learn(Patch& patch, const Vec2& gap_px);
  void hold(const Patch& patch, std::uint16_t feature, const PatchSearch::Found& found);
  bool own(const ImageView& image, const RowMask* missing, const Alignment& alignment, const Prediction& aligned, Corner& out);

  PatchConfig config_;
  std::vector<Point<frame::K>> body_;
  std::vector<bool> learnt_;              // by feature: its place is learnt
  std::vector<Patch> patches_;
  PatchSearch search_;
  LookMatcher looks_;
  LandmarkSet landmarks_;
};

}  // namespace cyclops
