#pragma once
/// Straight edges of the tanker between two of its features, and where they cross.
///
/// Many features are ends of edges: of a leading edge, a boot, a board. The pose that the corners agree on says within a pixel
/// or two where the segment between two features would lie; whether there is an edge, the image says. Nothing but the
/// feature table is needed: every pair of visible features is tried in turn, those that prove to be edges stay.
///
/// Find     across the predicted segment, every two pixels, extrema of the gradient; a vote over offset and slope, for each
///          polarity; then a robust line. An edge needs contrast, straightness and most of the segment.
/// Prove    strength rises with each frame in which a pair is found, and falls; only proven edges count.
/// Bias     an edge that runs beside the segment of the model (rounded, painted) keeps its distance: its variance about the
///          aligned pose is learnt.
/// Cross    a feature at which edges of different direction end is where these cross, with the covariance of that.
/// Frames   raw pixels; segments are straight in space and follow the lens in the image. Time: that of the frame.
/// Threads  one at a time. Memory: everything on construction. Deterministic.
/// Source   moving edges across a projected model: Harris & Stennett 1990 (RAPID) and the edge trackers after it; pairs that
///          prove themselves, vote and bias are ours.
#include <array>
#include <vector>

#include "edge/edge_config.hpp"
#include "geometry/camera.hpp"
#include "geometry/tanker_model.hpp"
#include "msg/chain.hpp"
#include "msg/frame.hpp"

namespace cyclops {

class EdgeFinder {
 public:
  EdgeFinder(const EdgeConfig& config, const TankerModel& model, const Camera& camera);

  /// Edges near where `alignment` and `aligned` (one prediction a feature) put them. Empty without consensus.
  void find(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned, EdgeSet& out);

  /// Strength and bias from the pose that all corners and edges agreed on. `out` is the set that find() gave.
  void learn(const Alignment& alignment, const EdgeSet& found);

  /// Appends the crossings of proven edges to `corners`, one a feature at most; what finds no room is counted there.
  void crossings(const EdgeSet& found, CornerSet& corners) const;

 private:
  static constexpr int kMostSamples = 32;
  static constexpr int kMostPeaks = 4;      // of one sample
  static constexpr int kMostReach = 15;     // px across
  struct Pair {
    std::uint16_t feature[2]{};
    double strength{0};
    double bias2{0};                        // px^2
  };
  struct Peak {
    float offset_px{0};
    bool rising{false};
  };
  struct Sample {
    double share{0};                        // 0 at the first feature, 1 at the second
    Vec2 at_px{0, 0};
    Vec2 normal{0, 0};
    bool readable{false};                   // the whole profile is in the image, and there
    std::array<float, 2 * kMostReach + 1> profile{};  // counts, from -reach along the normal
    int peaks{0};
    std::array<Peak, kMostPeaks> peak{};
  };
  struct Line {
    double offset_px{0};                    // in the middle of the segment
    double slope_px{0};                     // from end to end
    [[nodiscard]] double at(double share) const { return offset_px + slope_px * (share - 0.5); }
  };

  void choose(const PredictionSet& aligned);
  bool measure(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned, std::size_t pair, Edge& out);
  bool lay_samples(const Alignment& alignment, std::size_t pair, double reach_px);
  void take_profiles(const ImageView& image, const RowMask* missing);
  [[nodiscard]] double noise_sigma();
  void find_peaks(double least_gradient);
  [[nodiscard]] Line vote(bool rising, double sigma_px, double& score) const;
  bool fit(bool rising, Line& line, double& sigma_px, double& coverage) const;
  [[nodiscard]] Point<frame::K> along(const Pair& pair, double share) const;

  EdgeConfig config_;
  const Camera& camera_;
  std::vector<Point<frame::K>> body_;
  std::vector<bool> enabled_;
  std::vector<Pair> pairs_;
  std::vector<std::uint32_t> chosen_;
  std::size_t turn_{0};
  int reach_{0};
  std::array<Sample, kMostSamples> samples_{};
  std::size_t count_{0};
  std::vector<float> bends_;
};

}  // namespace cyclops
