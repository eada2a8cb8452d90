#pragma once
/// The parts of a rig that stages want in their own words.
#include "nav/nav_config.hpp"
#include "record/rig.hpp"
#include "timesync/frame_stamper.hpp"

namespace cyclops {

[[nodiscard]] FrameStamperConfig stamper_config(const Rig& rig);
[[nodiscard]] NavRig nav_rig(const Rig& rig);

}  // namespace cyclops
