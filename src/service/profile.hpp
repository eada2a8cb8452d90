#pragma once
/// A profile: what an algorithm engineer changes. One TOML file, one table a stage; it goes with any rig.
#include <string>

#include "align/align.hpp"
#include "associate/associate.hpp"
#include "base/result.hpp"
#include "detect/detect_config.hpp"
#include "edge/edge_config.hpp"
#include "estimate/estimate.hpp"
#include "flow/flow_config.hpp"
#include "nav/nav_config.hpp"
#include "patch/patch_config.hpp"
#include "publish/measure.hpp"
#include "segment/segment.hpp"
#include "track/tracker.hpp"

namespace cyclops {

/// The built-in profile; config/default.toml says the same, and a test holds them together.
struct Profile {
  Profile();
  std::string name{"built-in default"};
  NavConfig nav{};
  EstimateConfig estimate{};
  FlowConfig flow{};
  SegmentConfig segment{};
  DetectConfig detect{};
  AlignConfig align{};
  EdgeConfig edge{};
  PatchConfig patch{};
  AssociateConfig associate{};
  TrackConfig track{};
  PublishConfig publish{};

  /// Unknown, doubled and mistyped keys, and values out of range, are errors with file and line.
  static Result<Profile> load(const std::string& path);
};

}  // namespace cyclops
