#pragma once
/// Finds features by looks that were learnt in earlier flights: measurements from the first frame that has a pose.
///
/// A look knows where in it the feature is, so a match tells where the feature is, whatever error the pose of the frame has.
///
/// Fits     a look is tried when the view has turned by less than `view_deg` since it was taken and a metre is as many pixels as then,
///          within `scale`; of another lens too.
/// Choice   by measured strength: its matches' mean square distance from the aligned place, in its own flight to begin with, then here.
///          A failed match counts as a large distance. The least wins, nearer views first where two are as good.
/// Certain  as the match, what the look has shown, and what is known of its feature in it say together; and what all features of the
///          frame may share, as every patch has it.
/// Refused  one that does not agree with the aligned places, `steady_px` rms: it is tried on.
/// Frames   raw pixels. Threads: one at a time. Memory: everything on construction. Deterministic.
#include <vector>

#include "patch/looks.hpp"
#include "patch/patch_search.hpp"

namespace cyclops {

class LookMatcher {
 public:
  /// `looks` must outlive it. `features`: of the model.
  LookMatcher(const PatchConfig& config, const Camera& camera, const Looks& looks, std::size_t features);

  /// The place of one feature, as a corner that is it alone; false when no look of it fits, is found and is to be believed.
  bool find(PatchSearch& search, const ImageView& image, const RowMask* missing, const Alignment& alignment, const Prediction& aligned, Corner& out);

  void reset();

 private:
  struct Known {
    const Look* look{nullptr};
    Vec3 seen_from{0, 0, 0};   // unit, from the feature to the camera, k
    double px_per_m{0};
    double square_px2{0};      // of match less aligned place, an axis
  };
  Known* choose(const Pose<frame::C, frame::K>& T_c_k, const Prediction& aligned);

  PatchConfig config_;
  const Camera& camera_;
  std::vector<Known> known_;          // by feature
  std::vector<std::size_t> first_;    // of a feature; one more than there are
};

}  // namespace cyclops
