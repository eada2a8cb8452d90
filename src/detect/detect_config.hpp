#pragma once
/// What an algorithm engineer may change about corner detection: table "detect" of a profile.
#include "base/config.hpp"
#include "base/result.hpp"
#include "msg/limits.hpp"

namespace cyclops {

enum class DetectMode {
  kRefined,  ///< real pixels around the box, mean over the interior, noise floor, sub-pixel positions with covariance
  kThesis,   ///< spec 2.4 to the letter: zero padding, mean over the whole box, centres of pixels
};
/// What the mean threshold is the mean of.
enum class MeanOver {
  kInterior,     ///< the sub-image without its border
  kBox,          ///< all of it; with zero padding the border's blow-up counts
  kClearedBox,   ///< all of it, the border set to zero first
};
enum class Equalise {
  kOff,
  kBox,  ///< plain histogram equalisation of each sub-image; refinement and noise still use the pixels as they came
};
enum class NoiseSource {
  kEstimate,  ///< robustly from each sub-image
  kModel,     ///< read noise and gain below
};

struct DetectConfig {
  DetectMode mode{DetectMode::kRefined};
  double gaussian_sigma_px{1.0};      ///< of the circular window w
  int gaussian_size{7};               ///< odd, 3..13
  int nms_radius_px{3};               ///< square window, 1..7
  int border_px{5};                   ///< nothing is reported this close to the edge of a sub-image
  double noble_eps{1e-6};             ///< counts^2
  double threshold_factor{1};         ///< times the mean of the measure; 0 = no mean threshold
  MeanOver mean_over{MeanOver::kInterior};
  double floor_counts2{0};            ///< absolute floor of the measure, counts^2; 0 = off
  double floor_noise{5};              ///< floor of the measure in units of the pixel noise variance; 0 = off. Of pure noise
                                      ///< 2 leaves 7.4 maxima in 61x61 px, 3 leaves 0.27, 4 less than 0.02
  Equalise equalise{Equalise::kOff};
  NoiseSource noise{NoiseSource::kEstimate};
  double read_noise_counts{2};        ///< kModel: 1 sigma in the dark
  double counts_per_electron{0};      ///< kModel: photon noise variance = counts * this
  int subpixel_window_px{4};          ///< half size of the window, 2..6; 0 = centres of pixels
  int subpixel_iterations{10};
  double subpixel_max_shift_px{2.5};  ///< further from the strongest pixel than this is not the same corner
  double subpixel_sigma_px{0.05};     ///< floor of the localisation sigma
  double pixel_sigma_px{1.0};         ///< added to 1/12 px^2 when the centre of a pixel is reported
  int saturation_counts{-1};          ///< this value and above is not known; -1 = largest code of the format, 0 = off
  double saturation_sigma_px{0.5};    ///< 1 sigma added to a corner beside a saturated area; below 0: it is not reported
  int max_corners{kMaxCorners};       ///< of a frame; the strongest stay
  int max_corners_per_box{1024};
  double near_px{1.5};             ///< around an aligned feature: second look without a threshold; 0: none
  double near_sigma_px{0.3};       ///< larger 1 sigma that such a corner may have

  /// The thesis' settings: kThesis, mean over the box, no noise floor, no sub-pixel step, no saturation check.
  [[nodiscard]] static DetectConfig thesis();
  /// "mode" chooses the defaults of the other keys.
  [[nodiscard]] static Result<DetectConfig> read(ConfigTable& table, DetectConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const DetectConfig&) const = default;
};

}  // namespace cyclops
