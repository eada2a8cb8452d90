#pragma once
/// How the surroundings of each feature have looked, and where they are now.
///
/// Most surveyed points are no corners of the image: a hinge, the end of a gap, a thin trailing edge. What surrounds them can
/// still be found again. While the group of all features is aligned, each feature's surroundings are remembered at its aligned
/// place; in later frames they are turned and scaled as the pose says, and looked for near the new aligned place.
///
/// Anchor   the mean of matched less aligned place over the frames since the patch was taken is removed, so that a match
///          tells where the feature is and not what error the pose had in one frame. The anchor's variance shrinks with the
///          number of frames, down to a floor.
/// Steady   surroundings that belong to something else, before or behind, slide against the feature as the view turns: a patch
///          is used only while its place wanders little about its anchor.
/// Anew     a patch is taken again when the view has turned or the scale has changed too far, at the place that the old
///          one and its anchor give.
/// Match    normalised cross-correlation on whole pixels, then Gauss-Newton for the shift. Covariance from the gradients and
///          what the fit leaves over.
/// Frames   raw pixels. Time: that of the frame. Threads: one at a time. Memory: everything on construction. Deterministic.
/// Source   Lucas & Kanade 1981, Shi & Tomasi 1994 for the shift; anchor and use are ours.
#include <array>
#include <vector>

#include "geometry/camera.hpp"
#include "geometry/tanker_model.hpp"
#include "msg/chain.hpp"
#include "msg/frame.hpp"
#include "patch/patch_config.hpp"

namespace cyclops {

class PatchMatcher {
 public:
  PatchMatcher(const PatchConfig& config, const TankerModel& model, const Camera& camera);

  /// Appends the place of each visible feature that is found again to `corners`, and learns from the frame. `aligned` holds one
  /// prediction a feature, at the pose of `alignment`. Without consensus nothing happens.
  void step(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned, CornerSet& corners);

  void reset();

 private:
  static constexpr int kStoreHalf = 18;
  static constexpr int kStore = 2 * kStoreHalf + 1;
  static constexpr int kMostHalf = 10, kMostSearch = 9;
  static constexpr int kSide = 2 * kMostHalf + 1, kField = kSide + 2 * kMostSearch + 2;
  struct Patch {
    bool known{false};
    Pose<frame::C, frame::K> T_c_k{};     // when it was taken
    Vec2 inside_px{0, 0};                 // feature within the store, from its middle
    Vec2 offset_px{0, 0};                 // mean of matched less aligned place
    double frames{0};
    double wander2{0};                    // mean square of match less anchor, px^2 an axis
    int misses{0};                        // in a row
    std::array<float, kStore * kStore> store{};
  };
  struct Found {
    Vec2 uv_px{0, 0};
    Mat2 cov_px2{Mat2::Identity()};
  };

  bool take(const ImageView& image, const RowMask* missing, const Pose<frame::C, frame::K>& T, const Vec2& uv, Patch& patch) const;
  [[nodiscard]] bool looks_alike(const Patch& patch, const Pose<frame::C, frame::K>& T, std::size_t feature) const;
  bool turn(const Patch& patch, const Pose<frame::C, frame::K>& T, std::size_t feature);
  bool read_field(const ImageView& image, const RowMask* missing, const Vec2& around, int search, Vec2& origin);
  bool match(const ImageView& image, const RowMask* missing, const Prediction& aligned, double allowed_px, Found& out);
  double correlate(int shifts, Vec2& shift);
  void sum_fields();
  bool refine(Vec2& shift, Mat2& cov) const;

  PatchConfig config_;
  const Camera& camera_;
  std::vector<Point<frame::K>> body_;
  std::vector<Patch> patches_;
  int side_{0};
  std::array<float, kSide * kSide> warped_{};    // the patch as it should look now, mean removed
  double warped_norm_{0};
  std::array<float, kField * kField> field_{};   // the image around the aligned place
  int field_side_{0};
  std::vector<double> sum_, sum2_;               // (field_side_ + 1) squared
};

}  // namespace cyclops
