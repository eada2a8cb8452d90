#pragma once
/// Triangles on the raw image: projected through the lens and the windscreen, sampled on a regular grid in each pixel.
///
/// Exactness  edges are split until lens and windscreen bend them by less than 0.01 px, so a rendered edge lies on the
///            projection of the edge. Exposure is instantaneous: the pose is that of the middle of the exposure.
/// Limits     a triangle with a corner nearer than 0.5 m in front of the lens is left out.
/// Threads    const use from any.
#include <vector>

#include "geometry/camera.hpp"
#include "hil/mesh.hpp"

namespace cyclops::hil {

/// Light on the body, in counts of the sensor for a white surface that faces it; directions in NED.
struct Light {
  Vec3 to_sun_n{0, 0, -1};       ///< unit
  double sun{2000};              ///< counts
  double sky{1100};               ///< counts, from above
  double ground{2500};           ///< counts, from below
};

struct ScreenVertex {
  double u{0}, v{0};             ///< raw pixel
  double near{0};                ///< 1 / depth, 1/m
  float counts{0};
};
struct ScreenTriangle {
  ScreenVertex p[3];
};

/// The mesh on the image, shaded. `R_n_m` turns model directions to NED.
[[nodiscard]] std::vector<ScreenTriangle> project_mesh(const Mesh& mesh, const Camera& camera, const Pose<frame::C, frame::M>& T_c_m, const Mat3& R_n_m, const Light& light);

/// True when nothing lies nearer than `depth_m` - `margin_m` at that raw pixel. Exact, not on the grid.
[[nodiscard]] bool is_free(const std::vector<ScreenTriangle>& triangles, const Vec2& raw_px, double depth_m, double margin_m);

/// `columns` x `rows` samples a pixel. Adds the triangles to `image` (counts, width x height) which already holds the background.
void rasterise(const std::vector<ScreenTriangle>& triangles, int width, int height, int columns, int rows, std::vector<float>& image);

}  // namespace cyclops::hil
