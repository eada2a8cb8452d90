#pragma once
/// GigE Vision stream protocol, sending side: how a frame becomes packets, when they may leave, what can be sent again.
///
/// All of it is pure or owned by one thread at a time; sockets are in gige_device.cpp.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hil/gige_config.hpp"

namespace cyclops::hil {

/// Sizes of one stream. Packet sizes count IP and UDP headers, as register GevSCPSPacketSize does.
struct GvspLayout {
  bool extended{true};
  int packet_bytes{9000};
  [[nodiscard]] int header_bytes() const { return extended ? 20 : 8; }
  [[nodiscard]] int payload_bytes() const { return packet_bytes - 28 - header_bytes(); }
  /// Leader, payload packets and trailer.
  [[nodiscard]] std::uint32_t packets(std::size_t image_bytes) const {
    const auto room = static_cast<std::size_t>(payload_bytes());
    return static_cast<std::uint32_t>((image_bytes + room - 1) / room) + 2;
  }
  /// The number on the wire: 16-bit ids run 1..65535 and never 0.
  [[nodiscard]] std::uint64_t wire_id(std::uint64_t block_id) const {
    return extended || block_id == 0 ? block_id : (block_id - 1) % 65535 + 1;
  }
};

/// What a leader says.
struct GvspLeader {
  std::uint64_t tick{0};
  std::uint32_t pixel_format{0};
  std::uint32_t width{0};
  std::uint32_t height{0};
};

enum class GvspContent : std::uint8_t { kLeader = 1, kTrailer = 2, kPayload = 3 };
inline constexpr std::size_t kGvspMaxHead = 20 + 36;  ///< header and leader
inline constexpr std::uint16_t kGvspResent = 0x0100;  ///< status of a packet that is sent again

/// One packet as two parts: `head` is made here, `body` points into the image.
struct GvspPacket {
  std::array<std::uint8_t, kGvspMaxHead> head{};
  std::size_t head_bytes{0};
  std::span<const std::uint8_t> body;
};

/// `status`: 0, kGvspResent or a GvcpStatus. `packet_id` below layout.packets(image.size()).
void make_packet(const GvspLayout& layout, std::uint64_t wire_id, std::uint32_t packet_id, std::uint16_t status,
                 const GvspLeader& leader, std::span<const std::uint8_t> image, GvspPacket& out);
/// Header only, telling that a packet cannot be sent again.
void make_refusal(const GvspLayout& layout, std::uint64_t wire_id, std::uint32_t packet_id, std::uint16_t status, GvspPacket& out);

/// Deadlines of the batches of one frame. Absolute, so that a late wake-up is made good by the next one; moved when
/// later than `reanchor_after`, so that lateness never becomes a burst.
class Pacer {
 public:
  Pacer(std::int64_t start_ns, const GvspPacing& pacing) : next_ns_(start_ns), pacing_(pacing) {}
  /// When the next batch is due.
  [[nodiscard]] std::int64_t due() const { return next_ns_; }
  /// A batch leaves at `now_ns`: returns how late it is and sets the next deadline.
  std::int64_t leave(std::int64_t now_ns);
  [[nodiscard]] std::uint32_t reanchored() const { return reanchored_; }

 private:
  std::int64_t next_ns_;
  GvspPacing pacing_;
  std::uint32_t reanchored_{0};
};

/// Lets `per_second` packets through on average, a tenth of that at once.
class RateLimit {
 public:
  explicit RateLimit(int per_second) : per_second_(per_second), tokens_(depth()) {}
  /// How many of `wanted` may go now.
  std::uint32_t take(std::uint32_t wanted, std::int64_t now_ns);

 private:
  [[nodiscard]] double depth() const { return per_second_ * 0.1; }
  double per_second_;
  double tokens_;
  std::int64_t last_ns_{0};
  bool started_{false};
};

/// A frame as it was sent.
struct KeptFrame {
  std::uint64_t wire_id{0};  ///< 0: empty
  GvspLayout layout{};
  GvspLeader leader{};
  std::vector<std::uint8_t> image;
};

/// The last frames sent. A slot keeps its memory, so that nothing grows once every slot was used.
class ResendRing {
 public:
  explicit ResendRing(int frames) : slots_(static_cast<std::size_t>(frames > 0 ? frames : 1)) {}
  /// The oldest slot, to be filled by the caller.
  KeptFrame& replace();
  [[nodiscard]] const KeptFrame* find(std::uint64_t wire_id) const;
  void forget();

 private:
  std::vector<KeptFrame> slots_;
  std::size_t next_{0};
};

}  // namespace cyclops::hil
