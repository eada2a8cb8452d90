#pragma once
/// The rig: camera, mount, tanker, strobe and clocks of one installation, from rig.toml (docs/architecture.md).
#include <string>
#include <vector>

#include "base/config.hpp"
#include "capture/camera_config.hpp"
#include "capture/strobe_source.hpp"
#include "geometry/camera.hpp"
#include "geometry/tanker_model.hpp"
#include "msg/frame.hpp"
#include "nav/nav_config.hpp"
#include "patch/looks.hpp"
#include "timesync/frame_stamper.hpp"
#include "timesync/gps_clock.hpp"
#include "timesync/pps_marks.hpp"

namespace cyclops {

/// A file that rig.toml names.
struct RigFile {
  std::string as_written;
  std::string path;
};

struct Rig {
  std::string path;                    ///< of the file
  std::vector<RigFile> files;          ///< that it names
  CameraConfig device{};               ///< the camera as a device
  Camera camera{};                     ///< the camera as optics
  MountAngles mount_angles{};
  Point<frame::R> lens{};              ///< lens centre relative to the receiver's INS, m
  double boresight_sigma_rad{0};
  TankerModel tanker{};
  double tanker_unit_m{1};             ///< metres in one unit of the tanker's file
  Looks looks{};                       ///< how its features look; none unless the rig names a file
  StrobeConfig strobe{};
  StrobeConfig pps{};                  ///< kNone unless the rig has a line for it
  FrameStamperConfig stamper{};
  GpsClockConfig gps{};
  PpsConfig pps_marks{};
  NavRig nav{};

  /// `tanker`: a model file to use instead of the one that the rig names, in the same axes and units.
  /// `looks`: a file to use instead of the one that the rig names; looks of the rig go with its own model only.
  static Result<Rig> load(const std::string& path, const std::string& tanker = {}, const std::string& looks = {});
};

}  // namespace cyclops
