#pragma once
/// Figures of a generated flight to hold against the flight test's (spec 4.1 to 4.3). Definitions: docs/flights.md.
/// Threads  one at a time.
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <nlohmann/json.hpp>

#include "hil/flight_scene.hpp"
#include "segment/segment.hpp"

namespace cyclops::hil {

/// From pixels and truth: motion in the image, range, visible features, saturation, area to be searched.
class PictureFigures {
 public:
  explicit PictureFigures(const FlightScene& scene);
  /// Frames in order.
  void add(int frame, const std::vector<std::uint16_t>& pixels, const std::vector<FeatureTruth>& truth);
  [[nodiscard]] nlohmann::json json() const;

 private:
  struct OfFrame { double range_ft, motion_px, visible, doubtful, saturated_share, searched_share; std::size_t leg; };
  const FlightScene& scene_;
  std::unique_ptr<Segmenter> segmenter_;
  std::vector<OfFrame> frames_;
  std::vector<double> motions_px_;        ///< every feature, every frame
  std::vector<FeatureTruth> last_;
};

/// Projection error: where navigation and rig put a visible feature of the list against where it is.
class ProjectionFigures {
 public:
  void add(std::int32_t id, double error_px);
  void end_frame();
  [[nodiscard]] double mean_px() const { return n_ > 0 ? sum_ / n_ : 0; }
  [[nodiscard]] nlohmann::json json() const;

 private:
  static constexpr std::size_t kBins = 61;  ///< 1 px each, bin k is k-0.5..k+0.5; the last holds all above
  std::vector<std::int64_t> counts_ = std::vector<std::int64_t>(kBins, 0);
  std::map<std::int32_t, std::vector<std::int64_t>> by_feature_;
  std::vector<double> frame_mean_px_;
  double sum_{0}, frame_sum_{0};
  int n_{0}, frame_n_{0};
};

}  // namespace cyclops::hil
