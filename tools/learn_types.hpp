#pragma once
/// Learning the tanker: what the steps hand to one another. docs/learning.md tells the method.
///
/// Frames   raw pixels; points in tanker body axes (k), m; poses camera from tanker body, as Alignment has them.
/// Threads  plain data. Memory: heap; nothing here runs in flight.
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "align/pose.hpp"
#include "geometry/tanker_model.hpp"
#include "msg/chain.hpp"
#include "msg/frame.hpp"

namespace cyclops::tools::learn {

using align::CameraPose;

inline constexpr int kPatchHalf = 5, kPatchSide = 2 * kPatchHalf + 1;
using Patch = std::array<float, kPatchSide * kPatchSide>;  ///< mean 0, norm 1

/// A corner of one view and what surrounds it.
struct SeenCorner {
  Vec2 uv_px{0, 0};
  Mat2 cov_px2{Mat2::Identity()};
  Patch patch{};
};

/// Part of a frame, in its own format; empty unless looks are wanted.
struct Picture {
  int u0{0}, v0{0};                   ///< of its first pixel, in the frame
  int width{0}, height{0};
  PixelFormat format{PixelFormat::kMono8};
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] ImageView image() const { return {pixels.data(), width, height, width * bytes_per_pixel(format), format}; }
};

/// One frame whose pose the features agreed on.
struct View {
  int flight{0};                      ///< index into Views::flights
  double t_s{0};                      ///< since the first frame of its flight
  const Camera* camera{nullptr};
  CameraPose T_c_k{};
  Mat6 covariance{Mat6::Identity()};  ///< as Alignment::covariance
  std::vector<SeenCorner> corners;
  Picture picture{};
  std::vector<bool> visible{};        ///< by surveyed feature: predicted to be seen; only with a picture
};

/// Views in order of time, flight after flight.
struct Views {
  std::vector<std::string> flights;
  std::vector<std::unique_ptr<Camera>> cameras;  ///< one a flight
  std::vector<View> views;
  TankerModel tanker;                 ///< the surveyed features, the same in all flights
  double metres_per_unit{1};          ///< of the tanker's file
};

/// One corner of one view.
struct Sight {
  int view{0};
  int corner{0};
};

/// A place on the tanker, and where it was seen.
struct LearntPoint {
  Point<frame::K> p_k{};
  Mat3 cov_m2{Mat3::Identity()};      ///< k axes
  std::vector<Sight> sights;          ///< at most one a view, in order of views
  int survey{-1};                     ///< index of the surveyed feature that it is tied to; -1: none
  // Of the sights, once the poses and points have been adjusted:
  double scatter_px{1};               ///< rms residual an axis, robust
  double drift_px{0};                 ///< rms residual an axis of means over stretches of time, noise taken off: a point that slides
  double inflation{1};                ///< of the covariance: errors of neighbouring views are not independent
  double strength{0};                 ///< share of the views in which it was found, where it was to be seen
};

}  // namespace cyclops::tools::learn
