#pragma once
/// The rig: camera, mount, tanker, strobe and clocks of one installation, from rig.toml (docs/architecture.md).
#include <string>

#include "base/config.hpp"
#include "geometry/camera.hpp"
#include "geometry/tanker_model.hpp"
#include "msg/frame.hpp"

namespace cyclops {

enum class StrobeFrom : std::uint8_t { kNone, kSocket, kGpio };

struct Rig {
  std::string path;                    ///< of the file
  // camera as a device
  std::string address{"127.0.0.1"};
  PixelFormat pixel_format{PixelFormat::kMono8};
  double frame_rate_hz{30};
  double exposure_us{4000};
  // camera as optics
  Camera camera{};
  // mount
  MountAngles mount_angles{};
  Point<frame::R> lens{};              ///< lens centre relative to the receiver's INS, m
  double boresight_sigma_rad{0};
  // tanker
  TankerModel tanker{};
  // strobe
  StrobeFrom strobe{StrobeFrom::kNone};
  std::string strobe_socket{"@cyclops-strobe"};
  std::string strobe_chip{"gpiochip0"};
  std::string strobe_line{"0"};        ///< number or name
  bool strobe_rising{true};
  double strobe_delay_us{0};
  // table [tspi] is nav's and [time] partly timesync's; the service reads them from the same file
  Vec3 receiver_ins_from_tspi_m{0, 0, 0};
  Vec3 tanker_ins_from_tspi_m{0, 0, 0};
  double transport_max_ms{0};          ///< 0: the default of timesync
  bool block_ids_16_bit{false};

  static Result<Rig> load(const std::string& path);
};

}  // namespace cyclops
