#pragma once
/// GigE Vision control protocol, device side, as a pure function: registers and one packet in, one answer out.
///
/// Every byte that comes in is checked: a packet too short to name its request is counted and dropped, any other fault
/// is answered with a GVCP status. Nothing here opens a socket or reads a clock.
/// Source  GigE Vision 2.0, control protocol: DISCOVERY, READREG, WRITEREG, READMEM, WRITEMEM, PACKETRESEND.
#include <cstdint>
#include <optional>
#include <span>

#include "base/static_vector.hpp"

namespace cyclops::hil {

inline constexpr std::uint16_t kGvcpPort = 3956;
inline constexpr std::size_t kGvcpMaxPayload = 540;  ///< bytes after the header
inline constexpr std::size_t kGvcpHeader = 8;

enum class GvcpStatus : std::uint16_t {
  kSuccess = 0,
  kNotImplemented = 0x8001,
  kInvalidParameter = 0x8002,
  kInvalidAddress = 0x8003,
  kWriteProtect = 0x8004,
  kBadAlignment = 0x8005,
  kAccessDenied = 0x8006,
  kBusy = 0x8007,
  kPacketUnavailable = 0x800c,
  kInvalidHeader = 0x800e,
};

enum class GvcpCommand : std::uint16_t {
  kDiscovery = 0x02,
  kPacketResend = 0x40,
  kReadRegister = 0x80,
  kWriteRegister = 0x82,
  kReadMemory = 0x84,
  kWriteMemory = 0x86,
};

/// Who sent a packet; host byte order.
struct GvcpPeer {
  std::uint32_t address{0};
  std::uint16_t port{0};
  friend bool operator==(const GvcpPeer&, const GvcpPeer&) = default;
};

struct ResendRequest {
  std::uint64_t block_id{0};
  std::uint32_t first{0};
  std::uint32_t last{0};
  bool extended{false};
};

/// What an answered packet asks the device to do besides answering.
struct GvcpEffects {
  bool fire_test_packet{false};
  bool acquisition_changed{false};
  std::optional<ResendRequest> resend;
};

struct GvcpReply {
  StaticVector<std::uint8_t, kGvcpHeader + kGvcpMaxPayload> bytes;  ///< empty: no answer goes out
  GvcpStatus status{GvcpStatus::kSuccess};
  bool malformed{false};
  GvcpEffects effects;
};

class GigeRegisters;

/// `now_ns`: any steady clock, for the heartbeat; `tick`: the device clock, for the latch.
GvcpReply handle_gvcp(GigeRegisters& registers, std::span<const std::uint8_t> packet, GvcpPeer peer, std::int64_t now_ns,
                      std::uint64_t tick);

// Big-endian fields of both protocols; the caller has checked the room.
[[nodiscard]] inline std::uint16_t get_be16(const std::uint8_t* p) { return static_cast<std::uint16_t>(p[0] << 8 | p[1]); }
[[nodiscard]] inline std::uint32_t get_be32(const std::uint8_t* p) {
  return std::uint32_t{get_be16(p)} << 16 | get_be16(p + 2);
}
[[nodiscard]] inline std::uint64_t get_be64(const std::uint8_t* p) {
  return std::uint64_t{get_be32(p)} << 32 | get_be32(p + 4);
}
inline void put_be16(std::uint8_t* p, std::uint16_t v) {
  p[0] = static_cast<std::uint8_t>(v >> 8);
  p[1] = static_cast<std::uint8_t>(v);
}
inline void put_be32(std::uint8_t* p, std::uint32_t v) {
  put_be16(p, static_cast<std::uint16_t>(v >> 16));
  put_be16(p + 2, static_cast<std::uint16_t>(v));
}
inline void put_be64(std::uint8_t* p, std::uint64_t v) {
  put_be32(p, static_cast<std::uint32_t>(v >> 32));
  put_be32(p + 4, static_cast<std::uint32_t>(v));
}

}  // namespace cyclops::hil
