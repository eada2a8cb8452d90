#include "detect/subpixel.hpp"

#include <cmath>

#include "base/result.hpp"
#include "detect/corner_rows.hpp"

namespace cyclops {
namespace {

using lanes::all;
using lanes::F8;
using lanes::kLanes;
using lanes::load;
using lanes::store;

constexpr double kClose = 0.005;      // px: a smaller step ends the iterations
constexpr double kOneWay = 1e-3;      // det N / (trace N)^2 below this: an edge, not a corner
constexpr float kDeadZone2 = 2.25F;   // px^2
constexpr double kSobelNoise = 12.0 / 64;  // variance of a Sobel gradient over that of a pixel

/// Sobel's masks over 8 at index i of the middle one of three rows.
F8 sobel_x(const float (*row)[4 * kLanes], int i) {
  const auto difference = [&](int r) { return load(&row[r][i + 1]) - load(&row[r][i - 1]); };
  return (difference(-1) + difference(1) + all(2) * difference(0)) * all(0.125F);
}
F8 sobel_y(const float (*row)[4 * kLanes], int i) {
  const auto across = [&](int r) { return load(&row[r][i - 1]) + load(&row[r][i + 1]) + all(2) * load(&row[r][i]); };
  return (across(1) - across(-1)) * all(0.125F);
}

}  // namespace

SubpixelRefiner::SubpixelRefiner(const SubpixelConfig& config)
    : config_(config), side_(2 * (config.window_px + 1) + 1), vectors_(lanes::round_up(side_) / kLanes) {
  CYCLOPS_ASSERT(config.window_px >= 2 && config.window_px <= SubpixelConfig::kMaxWindow);
  for (int k = 0; k < 2 * kLanes; ++k) {
    inside_[k] = k >= 1 && k < side_ - 1 ? 1.0F : 0.0F;
    column_[k] = static_cast<float>(k - reach());
  }
}

Localised SubpixelRefiner::refine(const ImageView& image, int u, int v, double noise_variance_counts2) {
  Localised out;
  Vec2 q(u, v);
  for (int n = 0; n < config_.iterations; ++n) {
    const int cu = static_cast<int>(std::lround(q.x())), cv = static_cast<int>(std::lround(q.y()));
    const bool moved = cu != u_ || cv != v_;
    if ((n == 0 || (moved && 2 * n < config_.iterations)) && !take_window(image, cu, cv)) return out;
    const Normal m = solve(q.x() - u_, q.y() - v_);
    const double det = m.xx * m.yy - m.xy * m.xy, trace = m.xx + m.yy;
    if (!(det > kOneWay * trace * trace)) return out;
    const Vec2 step((m.yy * m.x - m.xy * m.y) / det, (m.xx * m.y - m.xy * m.x) / det);
    q += step;
    if (!((q - Vec2(u, v)).norm() <= config_.max_shift_px)) return out;
    if (step.norm() >= kClose) continue;
    out.converged = true;
    out.uv_px = q;
    out.misfit = m.residual2 / (kSobelNoise * noise_variance_counts2 * m.lever2);
    out.cov_px2 = covariance(m, noise_variance_counts2) * std::max(1.0, out.misfit) +
                  config_.sigma_floor_px * config_.sigma_floor_px * Mat2::Identity();
    return out;
  }
  return out;
}

/// Pixels around (u, v) and their gradients; false when the window does not fit into the image.
bool SubpixelRefiner::take_window(const ImageView& image, int u, int v) {
  const int u0 = u - reach(), v0 = v - reach();
  if (u0 < 0 || v0 < 0 || u0 + side_ > image.width || v0 + side_ > image.height) return false;
  u_ = u;
  v_ = v;
  for (int r = 0; r < side_; ++r) {
    float* out = &pixel_[r + 1][kEdge];
    if (image.format == PixelFormat::kMono8) for (int k = 0; k < side_; ++k) out[k] = image.row8(v0 + r)[u0 + k];
    else for (int k = 0; k < side_; ++k) out[k] = image.row16(v0 + r)[u0 + k];
  }
  for (int r = 2; r < side_; ++r)
    for (int i = 0; i < vectors_ * kLanes; i += kLanes) {
      store(&gx_[r][kEdge + i], sobel_x(&pixel_[r], kEdge + i) * load(inside_ + i));
      store(&gy_[r][kEdge + i], sobel_y(&pixel_[r], kEdge + i) * load(inside_ + i));
    }
  return true;
}

/// The normal equations about q = window centre + (qu, qv), and what the covariance will need.
SubpixelRefiner::Normal SubpixelRefiner::solve(double qu, double qv) {
  const float R = static_cast<float>(reach());
  F8 xx = all(0), xy = xx, yy = xx, bx = xx, by = xx, residual = xx, lever = xx;
  for (int r = 2; r < side_; ++r) {
    const F8 dy = all(static_cast<float>(r - 1 - reach() - qv));
    for (int i = 0; i < vectors_ * kLanes; i += kLanes) {
      const F8 dx = load(column_ + i) - all(static_cast<float>(qu)), x = load(&gx_[r][kEdge + i]), y = load(&gy_[r][kEdge + i]);
      const F8 d2 = dx * dx + dy * dy, e = x * dx + y * dy;
      const F8 w = lanes::larger(all(1) - d2 * all(1 / (R * R)), all(0)) * d2 / (d2 + all(kDeadZone2)) * load(inside_ + i);
      const F8 wx = w * x, wy = w * y, we = w * e;
      xx += wx * x;
      xy += wx * y;
      yy += wy * y;
      bx += wx * e;
      by += wy * e;
      residual += we * e;
      lever += w * d2;
      store(&xx_[r][kEdge + i], we + wx * dx);
      store(&xy_[r][kEdge + i], wx * dy);
      store(&yx_[r][kEdge + i], wy * dx);
      store(&yy_[r][kEdge + i], we + wy * dy);
    }
  }
  return {lanes::sum(xx), lanes::sum(xy), lanes::sum(yy), lanes::sum(bx), lanes::sum(by), lanes::sum(residual), lanes::sum(lever)};
}

/// s2 N^-1 (sum c c^T) N^-1. c is Sobel's mask once more, over what each gradient does to the right-hand side; that the mask
/// should be mirrored turns the sign of every c alike.
Mat2 SubpixelRefiner::covariance(const Normal& n, double noise_variance_counts2) {
  F8 xx = all(0), xy = xx, yy = xx;
  for (int r = 1; r <= side_; ++r)
    for (int i = kEdge; i < kEdge + vectors_ * kLanes; i += kLanes) {
      const F8 cx = sobel_x(&xx_[r], i) + sobel_y(&xy_[r], i), cy = sobel_x(&yx_[r], i) + sobel_y(&yy_[r], i);
      xx += cx * cx;
      xy += cx * cy;
      yy += cy * cy;
    }
  Mat2 N, C;
  N << n.xx, n.xy, n.xy, n.yy;
  C << lanes::sum(xx), lanes::sum(xy), lanes::sum(xy), lanes::sum(yy);
  const Mat2 inverse = N.inverse(), cov = noise_variance_counts2 * inverse * C * inverse;
  return 0.5 * (cov + cov.transpose());
}

}  // namespace cyclops
