#pragma once
/// Learns points of the tanker from recorded flights: views, follow, match and adjust again and again, choose.
///
/// Uses frames, navigation and the surveyed features of the flights, never their truth. docs/learning.md tells the method.
/// Errors   those of the steps; kUnusable when nothing is left that is worth keeping.
/// Threads  one at a time. Deterministic: the same flights give the same model.
#include <functional>

#include "tools/learn_bundle.hpp"
#include "tools/learn_choose.hpp"
#include "tools/learn_points.hpp"
#include "tools/learn_views.hpp"

namespace cyclops::tools::learn {

struct LearnConfig {
  ViewsConfig views{};
  FollowConfig follow{};
  BundleConfig bundle{};
  ChooseConfig choose{};
  struct Round {
    double match_px;             ///< radius in which a point takes a corner
    double tie_px;               ///< a point this near to a surveyed feature, on average over its views, is tied to it
  };
  std::vector<Round> rounds{{3.0, 0}, {2.0, 0}, {1.5, 0.8}, {1.5, 0.8}};  ///< of matching and adjusting; tie_px 0: none yet
};

struct Learnt {
  Views views;
  std::vector<ChosenPoint> points;   ///< best first; covariances inflated
  std::size_t followed{0};           ///< points before the choice
};

using Said = std::function<void(const std::string&)>;

Result<Learnt> learn(const std::vector<Stretch>& flights, const Profile& profile, const LearnConfig& config, const Said& said = {});

/// All but the first step: moves the poses of `views` too.
Result<std::vector<ChosenPoint>> learn_points(Views& views, const LearnConfig& config, std::size_t& followed, const Said& said = {});

}  // namespace cyclops::tools::learn
