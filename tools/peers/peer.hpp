#pragma once
/// What the peers share: each sees the frames, the predictions of navigation and the rig that Cyclops sees, from the same flight and at
/// the same navigation updates, and its measurements go into the same tables (tools/evaluate_tables.hpp).
///
/// Time     the peer's own step alone, scaling to 8 bits included; reported as chain time.
/// Pixels   8 bits, scaled so that the 99.9 % quantile of the first frame is 255. Points are raw pixels.
/// Covariance  a peer states none; 1 px2 is written, so coverage, NEES and the bound of its position say nothing.
/// Threads  one. OpenCV is held to one thread.
#include <functional>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "tools/evaluate_tables.hpp"

namespace cyclops::peers {

struct Found {
  FeatureId id{0};
  Vec2 raw_px{0, 0};
};

class Peer {
 public:
  virtual ~Peer() = default;
  /// `in.predictions` are navigation's when `in.in.nav.state.valid`, otherwise they are Cyclops' own and must not be used.
  virtual void step(const Rig& rig, const FrameOutput& in, const cv::Mat& grey, std::vector<Found>& out) = 0;
};

/// The whole program: arguments, flight, tables.
int run(int argc, char** argv, const char* about, const std::function<std::unique_ptr<Peer>(const Rig&)>& make);

}  // namespace cyclops::peers
