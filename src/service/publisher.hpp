#pragma once
/// One frame's results as LCM messages, live and offline alike. The order is fixed: FRAME NAV PREDICTION SUBIMAGE CORNER
/// TRACK MEASUREMENT; whoever has seen MEASUREMENT has the whole frame.
///
/// Threads  one at a time. Memory: on construction; none a frame.
#include <array>
#include <vector>

#include "service/rig.hpp"
#include "service/chain.hpp"
#include "service/sink.hpp"
#include "timesync/gps_clock.hpp"
#include "wire/codec.hpp"

namespace cyclops {

/// Where a frame's pixels are kept; nowhere by default.
struct RecordedAt {
  std::string_view in{};
  std::int64_t at{-1};
};

class Publisher {
 public:
  Publisher(const Rig& rig, MessageSink& sink);
  /// `t_mid_gps`: empty when the relation of the clocks is unknown. `thumbnail`: JPEG or empty.
  void frame(const FrameOutput& out, std::optional<GpsTime> t_mid_gps, std::span<const std::uint8_t> thumbnail, RecordedAt recorded = {});
  template <class Message>
  bool put(Time t, const char* name, const Message& message) {
    const Encoded bytes = encode_into(message, buffer_);
    if (bytes && sink_.put(t, name, bytes.data, bytes.size)) return true;
    ++failed_;
    return false;
  }
  [[nodiscard]] std::uint64_t failed() const { return failed_; }   ///< messages that were not delivered

 private:
  const Rig& rig_;
  MessageSink& sink_;
  Outbox box_;
  std::vector<std::uint8_t> buffer_;
  std::array<float, kMaxFeatures> gates_{};
  std::uint64_t failed_{0};
};

}  // namespace cyclops
