#pragma once
/// Corners of one frame: where the image changes in two directions, with a covariance.
///
/// In each sub-image: Noble's measure (corner_kernel.hpp), threshold at its mean, maxima in a square, the border dropped,
/// then sub-pixel refinement (subpixel.hpp). Modes: detect_config.hpp.
///
/// Frames   raw pixels, (0,0) the centre of the top-left pixel. Any pixel format, in its native counts.
/// Output   by sub-image, in each by strip of 192 columns, in each by row, then column. More than there is room for: the
///          strongest stay, the earlier of equals; the others are counted in `overflow`. `seq` and `t_mid` are the caller's.
/// Masks    a corner whose support touches a missing row, or a few saturated pixels (a defect, a glint), is not reported. Beside
///          a saturated area, such as a bright sky, the place of an edge is known less well: `saturation_sigma_px` is added.
///          Such pixels inside the sub-images are counted in `unreadable_px`.
/// Errors   none: a sub-image outside the image or too small for its border gives no corner.
/// Threads  one at a time (scratch inside). Memory: no heap after construction. Deterministic.
/// Source   spec 2.4; choices E12 and E38.
#include <vector>

#include "detect/corner_kernel.hpp"
#include "detect/detect_config.hpp"
#include "detect/equalise.hpp"
#include "detect/subpixel.hpp"
#include "msg/chain.hpp"

namespace cyclops {

class CornerDetector {
 public:
  /// For images up to max_width by max_height, at most kMaxImageSide each.
  CornerDetector(const DetectConfig& config, int max_width, int max_height);
  /// `missing`: rows without data, or null.
  void detect(const ImageView& image, const RowMask* missing, const SubImageSet& boxes, CornerSet& out);

  /// Looks once more, without a threshold, where a visible feature is expected and detect() found nothing near: appends what the
  /// sub-pixel step converges to, for that feature only. Call after detect, with the same image.
  void detect_near(const ImageView& image, const RowMask* missing, const PredictionSet& expected, CornerSet& out);

 private:
  struct Found {
    Peak peak;
    std::uint32_t box;
  };
  struct BoxFacts {
    double noise_variance{0};   ///< counts^2, kEstimate
    bool saturated{false};      ///< holds at least one saturated pixel
  };
  void search_box(const ImageView& image, const RowMask* missing, const PixelRect& box, std::uint32_t index, CornerSet& out);
  [[nodiscard]] KernelJob job_for(const ImageView& image, const RowMask* missing, const PixelRect& box);
  [[nodiscard]] double threshold(const KernelResult& result, const PixelRect& box) const;
  enum class Support { kClear, kClipped, kUnreadable };
  [[nodiscard]] Support support(const ImageView& image, const RowMask* missing, const BoxFacts& facts, int u, int v, int reach) const;
  void clip(Support support, Corner& corner) const;
  [[nodiscard]] bool needs_noise() const { return config_.floor_noise > 0 || config_.subpixel_window_px > 0; }
  [[nodiscard]] double noise_variance(const ImageView& image, const BoxFacts& facts, const Peak& peak) const;
  void report(const ImageView& image, const RowMask* missing, const Found& found, CornerSet& out);
  template <class T>
  std::size_t keep_strongest(T* items, std::size_t n, std::size_t room, CornerSet& out);

  DetectConfig config_;
  int max_width_, max_height_;
  int saturation_{0};           ///< of the frame at hand; 0 = off
  CornerKernel kernel_;
  SubpixelRefiner refiner_;
  Equaliser equaliser_;
  std::size_t found_size_{0};
  std::vector<Peak> peaks_;     ///< of one sub-image
  std::vector<Found> found_;    ///< of the frame
  std::vector<std::uint32_t> order_;
  std::vector<BoxFacts> facts_;
};

}  // namespace cyclops
