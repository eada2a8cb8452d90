#pragma once
/// Structs to LCM messages, and messages to bytes.
///
/// `fill` overwrites every field of a message that the caller keeps from frame to frame; with the messages of an Outbox
/// that never takes memory from the heap. Meaning, unit and frame of each field: lcmtypes/*.lcm and docs/icd.md.
/// Threads  one at a time for one message. Errors: none in `fill`; an Encoded without data when the room is too small.
#include <cyclops/acquisition_t.hpp>
#include <cyclops/corner_set_t.hpp>
#include <cyclops/event_t.hpp>
#include <cyclops/frame_index_t.hpp>
#include <cyclops/mark_t.hpp>
#include <cyclops/measurement_set_t.hpp>
#include <cyclops/nav_state_t.hpp>
#include <cyclops/prediction_set_t.hpp>
#include <cyclops/seal_t.hpp>
#include <cyclops/strobe_edge_t.hpp>
#include <cyclops/subimage_set_t.hpp>
#include <cyclops/time_mark_t.hpp>
#include <cyclops/track_set_t.hpp>
#include <cyclops/truth_t.hpp>
#include <cyclops/tspi_t.hpp>
#include <optional>
#include <span>

#include "wire/messages.hpp"

namespace cyclops {

/// Corners listed in one CORNER message, the strongest.
inline constexpr std::size_t kMaxSentCorners = 512;

void fill(frame_index_t& out, const FrameIndex& frame);
/// `used`: this frame's tracks were set from this state.
void fill(nav_state_t& out, std::uint64_t seq, const RelativeState& state, NavAbsence absence, bool used);
/// `nav` may be null: no navigation in this frame. `gate_px`: in the order of the items, or empty. `range_m` < 0: unknown.
void fill(prediction_set_t& out, const PredictionSet& set, const RelativeState* nav, double range_m, std::span<const float> gate_px);
/// `image_px`: pixels of the whole image.
void fill(subimage_set_t& out, std::uint64_t seq, Time t_mid, const SubImageSet& set, std::int64_t image_px);
/// The strongest `most` by Noble measure, strongest first; equal ones in the order of the set.
void fill(corner_set_t& out, const CornerSet& set, std::size_t most = kMaxSentCorners);
void fill(track_set_t& out, std::uint64_t seq, Time t_mid, const TrackSet& set);
void fill(measurement_set_t& out, const MeasurementSet& set, TimeSource source, std::optional<GpsTime> t_mid_gps);
void fill(event_t& out, const Event& event);
// What the service only receives; for the flight generator, the recorder and tests.
void fill(tspi_t& out, const TspiReport& report);
void fill(strobe_edge_t& out, const LineEdge& edge);
void fill(time_mark_t& out, const TimeMark& mark, MarkSource source);
void fill(truth_t& out, const Truth& truth);
void fill(acquisition_t& out, const Acquisition& change);
void fill(mark_t& out, const Mark& mark);
void fill(seal_t& out, const Seal& seal);

/// One message of each kind with room for the largest set.
struct Outbox {
  Outbox();
  frame_index_t frame{};
  nav_state_t nav{};
  prediction_set_t prediction{};
  subimage_set_t subimage{};
  corner_set_t corner{};
  track_set_t track{};
  measurement_set_t measurement{};
  event_t event{};
};

/// Bytes in the caller's buffer; no data when it was too small.
struct Encoded {
  const std::uint8_t* data{nullptr};
  std::size_t size{0};
  explicit operator bool() const { return data != nullptr; }
};

/// Room that every message but FRAME_DATA fits into.
inline constexpr std::size_t kMaxMessageBytes = std::size_t{1} << 21;

template <class Message>
[[nodiscard]] Encoded encode_into(const Message& message, std::span<std::uint8_t> buffer) {
  const int need = message.getEncodedSize();
  if (need < 0 || static_cast<std::size_t>(need) > buffer.size()) return {};
  const int n = message.encode(buffer.data(), 0, need);
  return n == need ? Encoded{buffer.data(), static_cast<std::size_t>(n)} : Encoded{};
}

/// FRAME_DATA straight from the pixels, without a message object in between.
[[nodiscard]] Encoded encode_into(const FrameDataView& frame, std::span<std::uint8_t> buffer);
[[nodiscard]] std::size_t encoded_size(const FrameDataView& frame);
/// All of FRAME_DATA in front of the pixels, which are its last bytes; at most kMaxFrameHeadBytes.
[[nodiscard]] Encoded encode_head_into(const FrameDataView& frame, std::span<std::uint8_t> buffer);
inline constexpr std::size_t kMaxFrameHeadBytes = 64 + kMaxImageSide / 8;

}  // namespace cyclops
