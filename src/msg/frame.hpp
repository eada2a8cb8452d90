#pragma once
/// One camera frame: what is known about it, and a view of its pixels.
#include <cstdint>

#include "base/time.hpp"
#include "msg/limits.hpp"

namespace cyclops {

enum class PixelFormat : std::uint8_t {
  kMono8,   ///< one byte a pixel
  kMono10,  ///< two bytes a pixel, little endian, values 0..1023
  kMono12,  ///< two bytes a pixel, little endian, values 0..4095
  kMono16,  ///< two bytes a pixel, little endian
};

[[nodiscard]] constexpr int bytes_per_pixel(PixelFormat f) { return f == PixelFormat::kMono8 ? 1 : 2; }
[[nodiscard]] constexpr int bits_per_pixel(PixelFormat f) {
  return f == PixelFormat::kMono8 ? 8 : f == PixelFormat::kMono10 ? 10 : f == PixelFormat::kMono12 ? 12 : 16;
}

enum class FrameStatus : std::uint8_t {
  kComplete,  ///< every pixel arrived
  kPartial,   ///< pixels valid outside the missing rows
  kMissing,   ///< no pixels: only seq, camera_frame_id and the times say anything
};

/// Pixels of one frame, not owned. Row-major, rows `stride_bytes` apart.
struct ImageView {
  const std::uint8_t* data{nullptr};
  int width{0};
  int height{0};
  int stride_bytes{0};
  PixelFormat format{PixelFormat::kMono8};
  [[nodiscard]] const std::uint8_t* row8(int v) const { return data + static_cast<std::ptrdiff_t>(v) * stride_bytes; }
  [[nodiscard]] const std::uint16_t* row16(int v) const { return reinterpret_cast<const std::uint16_t*>(row8(v)); }
  [[nodiscard]] std::size_t size_bytes() const { return static_cast<std::size_t>(stride_bytes) * static_cast<std::size_t>(height); }
};

/// Rows that did not arrive: bit v set means row v holds no data of this frame.
struct RowMask {
  std::uint64_t bits[kMaxImageSide / 64]{};
  [[nodiscard]] bool missing(int v) const { return (bits[v >> 6] >> (v & 63) & 1U) != 0; }
  void set_missing(int v) { bits[v >> 6] |= std::uint64_t{1} << (v & 63); }
  [[nodiscard]] int count() const {
    int n = 0;
    for (std::uint64_t word : bits) n += __builtin_popcountll(word);
    return n;
  }
};

/// Which clock a frame's time comes from, best first.
enum class TimeSource : std::uint8_t { kStrobe, kCameraTick, kArrival, kUnknown };

struct FrameInfo {
  std::uint64_t seq{0};              ///< capture number since the service started; a gap means lost frames
  std::uint64_t camera_frame_id{0};  ///< block id of the GVSP leader; 0 when the leader was lost
  std::int64_t camera_tick_ns{0};    ///< camera clock at the start of exposure, scaled to ns
  Time t_arrival{};                  ///< first packet on this host, service clock; diagnostics only
  Time t_mid{};                      ///< middle of the exposure, service clock
  Duration t_mid_sigma{};            ///< 1 sigma of t_mid
  Duration exposure{};
  TimeSource time_source{TimeSource::kUnknown};
  FrameStatus status{FrameStatus::kMissing};
  std::uint32_t missing_rows{0};
};

}  // namespace cyclops
