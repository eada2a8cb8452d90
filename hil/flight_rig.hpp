#pragma once
/// What a flight says about itself: rig.toml and the manifest.
#include <string>

#include "hil/flight_scene.hpp"
#include "nav/nav_config.hpp"
#include "record/flight.hpp"

namespace cyclops::hil {

/// rig.toml with the mount and lens as told, and from where on the aircraft TSPI speaks.
[[nodiscard]] std::string rig_toml(const FlightScene& scene, const CameraPlace& told, const NavRig& points);
[[nodiscard]] FlightManifest flight_manifest(const FlightScene& scene, const std::string& source);

}  // namespace cyclops::hil
