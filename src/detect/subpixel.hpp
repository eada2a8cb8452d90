#pragma once
/// Where between the pixels a corner is, and how well the image says so.
///
/// At a corner q every gradient nearby is normal to the line from q: g_i . (p_i - q) = 0. With gradients g from Sobel's mask
/// (divided by 8, counts per pixel) over a square window around q, least squares gives
///     N dq = sum w g (g . d),   N = sum w g g^T,   d = p - q,
/// repeated until dq is small; the window follows q in whole pixels (for the first half of the iterations, so that it cannot
/// hop between two for ever), the weight in fractions of one:
///     w(d) = max(0, 1 - |d|^2 / R^2) |d|^2 / (|d|^2 + r^2),  R = window + 1, r = 1.5 px.
/// The second factor keeps out the middle, where blur rounds the corner off and pulls the solution inwards.
///
/// Covariance: noise of variance s2 in each pixel goes through the linearised solution, dq = N^-1 sum_k c_k n_k with
/// c_k = d(sum w g (g . d)) / d I_k, so that cov = s2 N^-1 (sum c c^T) N^-1. It is multiplied by
/// max(1, sum w (g . d)^2 / its expectation from noise alone) for edges that are not straight, and a floor is added.
///
/// Frames   raw pixels. Units: counts; px^2. Threads: one at a time (scratch inside). Memory: no heap.
/// Source   Foerstner & Guelch 1987 (the orthogonality condition, also OpenCV's cornerSubPix); weight and covariance are ours,
///          consistency by Monte Carlo in test/detect/subpixel_test.cpp.
#include "detect/lanes.hpp"
#include "geometry/frames.hpp"
#include "msg/frame.hpp"

namespace cyclops {

struct SubpixelConfig {
  static constexpr int kMaxWindow = 6;
  int window_px{4};          ///< half size, 2..kMaxWindow
  int iterations{10};
  double max_shift_px{2.5};  ///< from the start
  double sigma_floor_px{0.05};
};

struct Localised {
  bool converged{false};  ///< false: the other members say nothing
  Vec2 uv_px{0, 0};
  Mat2 cov_px2{Mat2::Identity()};
  double misfit{0};       ///< weighted residual over its expectation from noise; near 1 for an ideal corner
};

class SubpixelRefiner {
 public:
  explicit SubpixelRefiner(const SubpixelConfig& config);
  /// From the pixel (u, v). Does not converge when the window leaves the image, the gradients span one direction only, the
  /// solution leaves the allowed shift or the iterations run out.
  Localised refine(const ImageView& image, int u, int v, double noise_variance_counts2);
  /// The window's reach in pixels around its centre, gradients included.
  [[nodiscard]] int reach() const { return config_.window_px + 1; }

 private:
  /// A window of floats: column k is pixel u - reach + k, kept at index kEdge + k so that both neighbours exist.
  static constexpr int kSide = 2 * (SubpixelConfig::kMaxWindow + 1) + 1;
  static constexpr int kEdge = lanes::kLanes;
  using Grid = float[kSide + 2][4 * lanes::kLanes];
  struct Normal {
    double xx{0}, xy{0}, yy{0};  ///< N
    double x{0}, y{0};           ///< right-hand side
    double residual2{0};         ///< sum w (g . d)^2
    double lever2{0};            ///< sum w |d|^2
  };
  bool take_window(const ImageView& image, int u, int v);
  [[nodiscard]] Normal solve(double qu, double qv);
  [[nodiscard]] Mat2 covariance(const Normal& n, double noise_variance_counts2);

  SubpixelConfig config_;
  int side_;     ///< pixels of the window's side, 2 reach + 1
  int vectors_;  ///< to cover a row
  int u_{0}, v_{0};
  alignas(64) Grid pixel_{}, gx_{}, gy_{};
  alignas(64) Grid xx_{}, xy_{}, yx_{}, yy_{};  ///< d right-hand side (x, y) / d gradient (x, y), weights included
  alignas(64) float inside_[2 * lanes::kLanes]{};
  alignas(64) float column_[2 * lanes::kLanes]{};
};

}  // namespace cyclops
