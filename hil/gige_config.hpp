#pragma once
/// What the GigE Vision device is: set before it is live, never changed by code afterwards (a client may, by register).
#include <cstdint>
#include <string>

#include "base/time.hpp"
#include "msg/frame.hpp"
#include "msg/limits.hpp"

namespace cyclops::hil {

/// Packets leave in batches on absolute deadlines, as a wire would bring them.
struct GvspPacing {
  int packets_per_batch{4};
  Duration gap{170'000};           ///< between batches; 4 packets of 9000 bytes in 170 us are 1.7 Gb/s
  Duration reanchor_after{340'000};  ///< later than this, the schedule moves instead of being caught up
};

struct GigeConfig {
  std::string address{"127.0.0.1"};  ///< IPv4, loopback or private; one device an address (port 3956 is fixed)
  std::string vendor{"Cyclops"};     ///< at most 31 characters
  std::string model{"Bench camera"};  ///< at most 31 characters
  std::string serial{"CYC0001"};     ///< at most 15 characters
  int width{1024};                   ///< px
  int height{1024};                  ///< px
  int max_width{kMaxImageSide};      ///< px
  int max_height{kMaxImageSide};     ///< px
  bool fixed_geometry{false};        ///< refuse every other width, height and pixel format
  PixelFormat format{PixelFormat::kMono8};
  double frame_rate_hz{30.0};        ///< nominal: the caller of send() gives the cadence
  double exposure_us{4000.0};
  std::uint64_t tick_hz{1'000'000'000};  ///< of the timestamps in leader and latch
  bool extended_ids{true};           ///< 64-bit block and 32-bit packet ids; false: 16 and 24 bits
  int max_packet_bytes{9000};        ///< with IP and UDP headers (28)
  int heartbeat_ms{3000};
  GvspPacing pacing{};
  int resend_frames{4};              ///< frames kept for PACKETRESEND
  int resend_packets_per_s{40'000};  ///< token bucket; its depth is one second's worth / 10
};

}  // namespace cyclops::hil
