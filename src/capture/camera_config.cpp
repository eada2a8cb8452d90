#include "capture/camera_config.hpp"

#include <cmath>

namespace cyclops {
namespace {

template <class T>
Result<> inside(const char* key, T value, T low, T high) {
  if (value >= low && value <= high) return Ok{};
  return make_error(ErrorCode::kInvalid, std::string("camera.") + key,
                    "is " + std::to_string(value) + ", expected [" + std::to_string(low) + ", " + std::to_string(high) + "]");
}

}  // namespace

Result<> validated(const CameraConfig& c) {
  CYCLOPS_TRY(inside("width_px", c.width_px, 1, kMaxImageSide));
  CYCLOPS_TRY(inside("height_px", c.height_px, 1, kMaxImageSide));
  CYCLOPS_TRY(inside("frame_rate_hz", c.frame_rate_hz, 0.1, 1000.0));
  CYCLOPS_TRY(inside("exposure_us", c.exposure_us, 1.0, 1e6));
  if (c.packet_bytes != 0) CYCLOPS_TRY(inside("packet_bytes", c.packet_bytes, 576, 16'000));
  CYCLOPS_TRY(inside("buffers", c.buffers, 4, 64));
  CYCLOPS_TRY(inside("stream_priority", c.stream_priority, 0, 99));
  CYCLOPS_TRY(inside("watchdog_periods", c.watchdog_periods, 2, 10'000));
  CYCLOPS_TRY(inside("frozen_after", c.frozen_after, 0, 1000));
  CYCLOPS_TRY(inside("socket_buffer_bytes", c.socket_buffer_bytes, 65'536, 1 << 30));
  return Ok{};
}

const char* name_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::kMono8: return "Mono8";
    case PixelFormat::kMono10: return "Mono10";
    case PixelFormat::kMono12: return "Mono12";
    case PixelFormat::kMono16: return "Mono16";
  }
  return "?";
}

}  // namespace cyclops
