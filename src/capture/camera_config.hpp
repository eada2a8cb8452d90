#pragma once
/// What the camera must be, and how patient we are with it.
#include <string>

#include "base/result.hpp"
#include "base/time.hpp"
#include "msg/frame.hpp"

namespace cyclops {

struct CameraConfig {
  // The settings are written at every start of the stream, read back, and must then be as wanted.
  std::string address{"127.0.0.1"};  ///< IPv4 of the camera; nothing is ever broadcast
  int width_px{1024};
  int height_px{1024};
  PixelFormat format{PixelFormat::kMono8};
  double frame_rate_hz{30.0};
  double exposure_us{4000.0};
  int packet_bytes{0};               ///< with IP and UDP headers; 0: the largest that passes a test
  std::string strobe_line{};         ///< e.g. "Line1": its LineSource becomes ExposureActive; empty: left alone

  // Reception.
  int buffers{24};                   ///< frames between camera and the last reader, the pool; [4, 64]
  int socket_buffer_bytes{4'000'000};
  Duration packet_timeout{2'000'000};    ///< before a missing packet is asked for again
  Duration frame_retention{25'000'000};  ///< before an incomplete frame is given up; later frames wait for it
  int stream_priority{0};            ///< SCHED_FIFO of the receiving thread, [0, 99]; 0: ordinary

  // Loss of the camera.
  int watchdog_periods{15};          ///< frame periods without a frame that end the stream, and
  Duration watchdog_least{500'000'000};  ///< at least this long
  Duration probe_timeout{250'000'000};   ///< for one answer to "are you there"
  Duration retry_every{200'000'000};     ///< between attempts to open again

  // What a camera that streams may still do wrong.
  Duration verify_every{250'000'000};  ///< exposure and frame rate are read back so often; 0: never
  int frozen_after{2};                   ///< so many repeats of one picture are believed, more are not; 0: all are

  [[nodiscard]] Duration period() const { return Duration::from_seconds(1.0 / frame_rate_hz); }
  [[nodiscard]] int row_bytes() const { return width_px * bytes_per_pixel(format); }
  [[nodiscard]] std::size_t payload_bytes() const { return static_cast<std::size_t>(row_bytes()) * static_cast<std::size_t>(height_px); }
  [[nodiscard]] Duration watchdog() const {
    const Duration d = period() * watchdog_periods;
    return d < watchdog_least ? watchdog_least : d;
  }
  /// Silence that ends a stream, after `fruitless` streams in a row without a single frame: a camera that is there but sends
  /// nothing (paused, waiting for a trigger) is asked again more and more seldom.
  [[nodiscard]] Duration patience(int fruitless) const { return watchdog() * (std::int64_t{1} << (fruitless < kMostDoublings ? fruitless : kMostDoublings)); }
  static constexpr int kMostDoublings = 3;
};

/// Names the first value that is out of range.
Result<> validated(const CameraConfig& config);
/// "Mono8" ... as GenICam and the standard name them.
[[nodiscard]] const char* name_of(PixelFormat format);

}  // namespace cyclops
