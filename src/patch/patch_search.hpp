#pragma once
/// Inside patch: looks for one stored patch near a place in a picture.
///
/// Turn     the patch as it should look from a pose: a small plane through the feature, facing the camera when it was taken.
/// Match    normalised cross-correlation on whole pixels, then Gauss-Newton for the shift, with the expected place as prior: along
///          an edge the picture tells nothing. Covariance from the gradients, what the fit leaves over, and the prior.
/// Frames   raw pixels. Threads: one at a time. Memory: everything on construction. Deterministic.
/// Source   Lucas & Kanade 1981, Shi & Tomasi 1994 for the shift.
#include <vector>

#include "geometry/camera.hpp"
#include "msg/chain.hpp"
#include "msg/frame.hpp"
#include "patch/patch_config.hpp"
#include "patch/stored_patch.hpp"

namespace cyclops {

class PatchSearch {
 public:
  /// `camera` must outlive it.
  PatchSearch(const PatchConfig& config, const Camera& camera);

  struct Found {
    Vec2 uv_px{0, 0};
    Mat2 cov_px2{Mat2::Identity()};
    double correlation{0};               ///< on whole pixels
  };

  /// Stores what is around `uv`, where the feature at `p_k` is; false when it is not all in the image.
  bool take(const ImageView& image, const RowMask* missing, const Pose<frame::C, frame::K>& T_c_k, const Point<frame::K>& p_k, const Vec2& uv_px, StoredPatch& out) const;
  /// To be called before match; false when the patch is too small for this pose or has no contrast.
  bool turn(const StoredPatch& patch, const Pose<frame::C, frame::K>& T_c_k, const Point<frame::K>& p_k);
  /// Offsets in the stored picture from those in the turned one.
  [[nodiscard]] const Mat2& then_from_now() const { return A_; }
  /// The turned patch near `expected`, as far as its covariance without `common_px` says.
  bool match(const ImageView& image, const RowMask* missing, const Prediction& expected, double common_px, Found& out);

 private:
  static constexpr int kMostHalf = 10, kMostSearch = 9;
  static constexpr int kSide = 2 * kMostHalf + 1, kField = kSide + 2 * kMostSearch + 2;

  bool read_field(const ImageView& image, const RowMask* missing, const Vec2& around, int search, Vec2& origin);
  double correlate(int shifts, Vec2& shift);
  void sum_fields();
  /// `expected`: shift, with this 1 sigma an axis.
  bool refine(const Vec2& expected, double sigma_px, Vec2& shift, Mat2& cov) const;

  PatchConfig config_;
  const Camera& camera_;
  int side_{0};
  Mat2 A_{Mat2::Identity()};
  std::array<float, kSide * kSide> warped_{};    // the patch as it should look now, mean removed
  double warped_norm_{0};
  std::array<float, kField * kField> field_{};   // the image around the aligned place
  int field_side_{0};
  std::vector<double> sum_, sum2_;               // (field_side_ + 1) squared
};

}  // namespace cyclops
