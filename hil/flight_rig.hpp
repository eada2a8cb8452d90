#pragma once
/// What a flight says about itself: rig.toml and the manifest.
#include <string>

#include "hil/flight_scene.hpp"
#include "nav/nav_config.hpp"
#include "record/flight.hpp"

namespace cyclops::hil {

/// What the rig file tells of the aircraft: mount and lens, how sure the mount is, and from where TSPI speaks.
struct ToldRig {
  CameraPlace place{};
  double boresight_sigma_deg{0};
  NavRig points{};
};
[[nodiscard]] std::string rig_toml(const FlightScene& scene, const ToldRig& told);
[[nodiscard]] FlightManifest flight_manifest(const FlightScene& scene, const std::string& source);

/// The windscreen that the rig tells: the exact one, or what a calibration made of it.
[[nodiscard]] Result<Windscreen> said_windscreen(const FlightScene& scene);

}  // namespace cyclops::hil
