#pragma once
/// From a point in the camera frame to a raw pixel and back: pinhole, lens distortion, windscreen.
///
/// Sources   spec 1.2 steps 4 and 5, 2.2; the lens model is Brown-Conrady k1 k2 p1 p2 k3 as in OpenCV's documentation.
/// Threads   const use from any; no heap.
#include <optional>

#include "geometry/frames.hpp"
#include "geometry/windscreen.hpp"

namespace cyclops {

struct Intrinsics {
  int width{1024};
  int height{1024};
  double fx_px{1041.6666666666667};  ///< focal length / pixel pitch
  double fy_px{1041.6666666666667};
  double cx_px{511.5};               ///< principal point; (0,0) is the centre of the top-left pixel
  double cy_px{511.5};
  double k1{0}, k2{0}, p1{0}, p2{0}, k3{0};
  double pitch_m{12e-6};             ///< pixel pitch, only for Z(t) in metres
};

class Camera {
 public:
  Camera() = default;
  Camera(const Intrinsics& intrinsics, Windscreen windscreen) : k_(intrinsics), windscreen_(std::move(windscreen)) {}
  [[nodiscard]] const Intrinsics& intrinsics() const { return k_; }
  [[nodiscard]] const Windscreen& windscreen() const { return windscreen_; }

  /// Ideal pixel of a point; nothing when it is not in front of the lens (z <= 0).
  [[nodiscard]] std::optional<Vec2> project_ideal(const Point<frame::C>& p) const;
  /// Raw pixel of a point; nothing when z <= 0 or so far off axis that the lens model folds back.
  [[nodiscard]] std::optional<Vec2> project(const Point<frame::C>& p) const;
  /// As project, with d raw / d p_c (2x3).
  [[nodiscard]] std::optional<Vec2> project(const Point<frame::C>& p, Eigen::Matrix<double, 2, 3>& jacobian) const;
  [[nodiscard]] Vec2 raw_from_ideal(const Vec2& ideal_px) const;
  [[nodiscard]] Vec2 ideal_from_raw(const Vec2& raw_px) const;
  /// d ideal / d raw at a raw pixel.
  [[nodiscard]] Mat2 ideal_from_raw_jacobian(const Vec2& raw_px) const;
  /// Metres on the image plane, x to image left, y to image top. Spec 1.2 and 2.9.
  [[nodiscard]] Vec2 z_point_m(const Vec2& ideal_px) const;
  /// Unit vector to the ideal pixel in camera axes.
  [[nodiscard]] Vec3 line_of_sight(const Vec2& ideal_px) const;
  [[nodiscard]] bool inside(const Vec2& raw_px) const;  ///< within the pixels' area: -0.5 .. width - 0.5

 private:
  [[nodiscard]] Vec2 lens(const Vec2& xy) const;  ///< normalised, undistorted -> distorted
  [[nodiscard]] bool has_lens() const { return k_.k1 != 0 || k_.k2 != 0 || k_.p1 != 0 || k_.p2 != 0 || k_.k3 != 0; }
  Intrinsics k_{};
  Windscreen windscreen_{};
};

}  // namespace cyclops
