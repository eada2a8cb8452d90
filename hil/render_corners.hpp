#pragma once
/// How far rendered corners lie from where the camera model puts them.
///
/// Method   a window of the drawn layer (albedo at the camera's own resolution, no lens) is fitted by a wedge: two straight edges from
///          one apex, each pixel the exact share of its area. The fit knows nothing of cameras; the projection only chooses the window.
///          A corner counts when a window of 13 px leaves less than 1.5 % of its contrast, rms, or windows of 9 and of 7 px do and agree
///          within 0.1 px: others are no wedge of two straight edges.
/// Threads  any.
#include <optional>
#include <string>
#include <vector>

#include "hil/render.hpp"

namespace cyclops::hil {

/// Apex of the wedge around `guess` (within a few px of it); nothing when the window is no wedge.
[[nodiscard]] std::optional<Vec2> wedge_apex(const std::vector<float>& image, int width, int height, const Vec2& guess);

struct CornerError { std::int32_t id; double px; };
/// Visible features whose corner is a wedge, drawn with `zoom` times the pixels: at the camera's own resolution a boot is as thin as a
/// pixel and its corner cannot be told from that of the wing behind it. Errors in the camera's pixels. No lens distortion, no windscreen.
[[nodiscard]] std::vector<CornerError> feature_corners(const Intrinsics& intrinsics, const Mesh& mesh, const View& view, const TankerModel& model, int zoom);
/// 36 tilted squares, `range_m` away, over the middle half of the picture: all of their corners.
[[nodiscard]] std::vector<CornerError> board_corners(const Intrinsics& intrinsics, double range_m);
/// A level formation: lens `range_ft` behind `reference_in` (model axes; the C-12's tail tip) at `elevation_deg`, tilted up by 16 deg.
[[nodiscard]] View level_view(double range_ft, double elevation_deg, double azimuth_deg = 0, const Vec3& reference_in = {511, 0, 123});

}  // namespace cyclops::hil
