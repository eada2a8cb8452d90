#pragma once
/// What some messages carry beyond the structs of msg/. Views point into the bytes they were decoded from and live as long.
#include <cstdint>
#include <span>
#include <string_view>

#include "base/static_vector.hpp"
#include "msg/chain.hpp"
#include "msg/frame.hpp"
#include "msg/strobe.hpp"
#include "msg/tspi.hpp"

namespace cyclops {

enum class StrobeLine : std::uint8_t { kStrobe, kPps };
struct LineEdge {
  StrobeEdge edge{};
  StrobeLine line{StrobeLine::kStrobe};
};

enum class MarkSource : std::uint8_t { kPps, kTspiArrival, kRecorded };

/// FRAME: a frame without its pixels.
struct FrameIndex {
  FrameInfo info{};
  PixelFormat format{PixelFormat::kMono8};
  int width{0};                                   ///< px; may be 0 when the frame is kMissing
  int height{0};
  std::string_view recorded_in{};                 ///< file with the pixels, empty when not recorded
  std::int64_t recorded_at{-1};                   ///< event number in it
  std::span<const std::uint8_t> thumbnail_jpeg{};
};

/// FRAME_DATA: the pixels, not owned.
struct FrameDataView {
  std::uint64_t camera_frame_id{0};
  std::int64_t camera_tick_ns{0};
  Duration exposure{};
  FrameStatus status{FrameStatus::kMissing};
  PixelFormat format{PixelFormat::kMono8};
  int width{0};
  int height{0};
  RowMask missing{};
  std::span<const std::uint8_t> pixels{};         ///< row-major without padding; empty when kMissing

  /// False: 16-bit pixels at an odd address, to be copied before they are looked at.
  [[nodiscard]] bool aligned() const { return bytes_per_pixel(format) == 1 || reinterpret_cast<std::uintptr_t>(pixels.data()) % 2 == 0; }
  /// Needs aligned().
  [[nodiscard]] ImageView image() const {
    CYCLOPS_ASSERT(aligned());
    return {pixels.data(), width, height, width * bytes_per_pixel(format), format};
  }
};

enum class TruthVisibility : std::uint8_t { kHidden, kVisible, kDoNotScore };
struct TruthPoint {
  FeatureId id{0};
  Vec2 uv_px{0, 0};                               ///< raw pixel
  TruthVisibility visibility{TruthVisibility::kHidden};
  std::uint32_t reasons{0};                       ///< truth_t::OUT_OF_FIELD .. BLOWN_OUT; only with has_detail
  Vec2 ideal_px{0, 0};                            ///< without windscreen and lens distortion; only with has_detail
};
struct Truth {
  std::uint64_t camera_frame_id{0};
  Time t_mid{};
  Duration exposure{};                            ///< 0: unknown
  bool has_pose{false};
  Pose<frame::R, frame::K> T_r_k{};               ///< only with has_pose
  Vec3 sun_c{0, 0, 0};                            ///< unit vector towards the sun, camera axes; zero: unknown
  bool has_detail{false};                         ///< the points say why, and where they would be without lens and windscreen
  StaticVector<TruthPoint, kMaxFeatures> points{};
};

/// What the camera's stream did between two inputs.
enum class AcquisitionChange : std::uint8_t { kStarted, kSilent };
struct Acquisition {
  AcquisitionChange what{AcquisitionChange::kStarted};
  Time t{};                                       ///< kStarted: edges before it are of an earlier one; the least time: all count
};

/// A moment somebody marked.
struct Mark {
  static constexpr std::size_t kMaxText = 200;
  std::int32_t seq{0};
  std::string_view text{};                        ///< printable
};

/// Checksum over bytes [from, to) of a log.
struct Seal {
  std::int64_t from{0};
  std::int64_t to{0};
  std::uint64_t sum{0};
};

enum class EventLevel : std::uint8_t { kInfo, kWarning, kFault, kRecovery, kMark };
struct Event {
  Time t{};
  EventLevel level{EventLevel::kInfo};
  std::string_view source{};
  std::string_view code{};
  std::string_view text{};
  std::int64_t count{1};
};

}  // namespace cyclops
