#pragma once
/// Where the windscreen moves a line of sight, as two matrices of pixels. Spec 2.2.
///
/// A point whose windscreen-free place is q appears at q + delta(q); the matrices are indexed by the
/// windscreen-free position, sampled bilinearly and held constant outside the image.
/// Threads: const use from any. Memory: the two grids, allocated on construction only.
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/frames.hpp"

namespace cyclops {

class Windscreen {
 public:
  Windscreen() = default;  ///< no windscreen: delta is zero everywhere
  /// `step_px`: grid spacing; node (i, j) is at v = i * step_px, u = j * step_px. 1 = one value a pixel.
  static Result<Windscreen> from_grids(int rows, int cols, double step_px, std::vector<float> delta_u_px,
                                       std::vector<float> delta_v_px);
  /// A small binary file: see docs/icd.md, "windscreen file".
  static Result<Windscreen> load(const std::string& path);
  [[nodiscard]] Result<> save(const std::string& path) const;

  [[nodiscard]] bool empty() const { return rows_ == 0; }
  [[nodiscard]] Vec2 delta(const Vec2& uv_px) const;
  [[nodiscard]] Mat2 delta_jacobian(const Vec2& uv_px) const;  ///< d delta / d uv
  [[nodiscard]] Vec2 distort(const Vec2& uv_px) const { return empty() ? uv_px : Vec2(uv_px + delta(uv_px)); }
  /// Fixed point q = raw - delta(q): stops below 1e-6 px, at most 20 steps. Spec 2.2.
  [[nodiscard]] Vec2 undistort(const Vec2& raw_px) const;

 private:
  int rows_{0};
  int cols_{0};
  double step_{1};
  std::vector<float> du_;
  std::vector<float> dv_;
};

}  // namespace cyclops
