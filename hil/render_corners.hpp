#pragma once
/// How far rendered corners lie from where the camera model puts them.
///
/// Method   a drawn layer (albedo, no light, no lens) is fitted by a junction of straight edges (hil/junction.hpp). The fit knows nothing
///          of cameras; the projection only chooses the window.
/// Threads  any.
#include <optional>
#include <vector>

#include "hil/render.hpp"

namespace cyclops::hil {

struct BoardCorner {
  std::int32_t id;
  double px;                   ///< distance from the projection
  Vec2 rendered_px;
  Point<frame::C> p_c;         ///< m
};

struct FeatureCorner {
  std::int32_t id{0};
  std::optional<double> px{};  ///< distance from the projection, camera's pixels; nothing: no junction was found there
  double sigma_px{0};          ///< of the measurement
  int zoom{0};                 ///< pixels of the drawing to one of the camera
  bool by_faces{false};        ///< edges between faces of one paint were needed
};

/// Every feature that is visible and scored. Each is drawn with 8 times the pixels and, until the fits of two zooms in a row agree, with
/// up to 1024 times, first in its paint, then with a brightness of its own for each smooth face: at the camera's own resolution a boot is
/// as thin as a pixel and its corner cannot be told from that of the wing behind it. No lens distortion, no windscreen.
[[nodiscard]] std::vector<FeatureCorner> feature_corners(const Intrinsics& intrinsics, const Mesh& mesh, const View& view, const TankerModel& model);
/// 36 tilted squares, `range_m` away, over the middle half of the picture, at the camera's own resolution: all of their corners, seen
/// through lens and windscreen; `parallax_mm` as in hil/look.hpp.
[[nodiscard]] std::vector<BoardCorner> board_corners(const Camera& camera, double range_m, double parallax_mm = 0);
/// A level formation: lens `range_ft` behind `reference_in` (model axes; the C-12's tail tip) at `elevation_deg`, tilted up by 16 deg.
[[nodiscard]] View level_view(double range_ft, double elevation_deg, double azimuth_deg = 0, const Vec3& reference_in = {511, 0, 123});

}  // namespace cyclops::hil
