#pragma once
/// Opens a camera by address and makes it what the configuration says, or says which setting it refuses to take.
///
/// Blocks: some ten round trips to the camera. Threads: any one. Errors: kNotFound nobody there, kIo another program is in
/// control or a transfer failed, kInvalid `where` is "camera ADDRESS: SETTING", `what` has value and expectation,
/// kUnsupported the camera lacks a setting that is needed.
#include "capture/arv.hpp"
#include "capture/camera_config.hpp"
#include "capture/gvcp_probe.hpp"

namespace cyclops {

struct OpenCamera {
  arv::Owner<ArvCamera> camera;
  CameraFound found;
  std::uint64_t tick_hz{0};  ///< of the camera's clock; 0: it has none
  int packet_bytes{0};
};

Result<OpenCamera> open_camera(const CameraConfig& config);
/// Reads exposure and frame rate back: no picture shows that they have changed, but times and light depend on them. kTimeout or
/// kNotFound: nobody answers, which says nothing about the settings.
Result<> verify_settings(const CameraConfig& config, ArvCamera* camera);

}  // namespace cyclops
