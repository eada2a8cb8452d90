#pragma once
/// Faults of a network or a camera, made inside the device so that a test gets the same ones every time.
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <set>

namespace cyclops::hil {

/// Which packet is about to leave.
struct PacketRef {
  std::uint64_t block_id{0};   ///< as on the wire
  std::uint32_t packet_id{0};  ///< 0 leader, count - 1 trailer
  std::uint32_t count{0};      ///< packets of the frame
  bool again{false};           ///< answer to a resend request
};

enum class PacketFate : std::uint8_t {
  kSend,
  kDrop,
  kTwice,
  kSwap,  ///< after the next packet instead of before it
};

/// Asked once a packet, by the thread that sends it (the caller of send(), or the control thread for resends).
using PacketFault = std::function<PacketFate(const PacketRef&)>;

namespace faults {

/// Whether an answer to a resend request suffers too: kOnce is repaired, kForEver is not.
enum class Reach : std::uint8_t { kOnce, kForEver };

[[nodiscard]] PacketFault drop_packets(std::uint64_t block_id, std::set<std::uint32_t> packets, Reach reach);
[[nodiscard]] PacketFault drop_leader(std::uint64_t block_id, Reach reach);
[[nodiscard]] PacketFault drop_trailer(std::uint64_t block_id, Reach reach);
[[nodiscard]] PacketFault drop_frame(std::uint64_t block_id);
/// Everything after the first `keep` packets of the frame is lost.
[[nodiscard]] PacketFault truncate(std::uint64_t block_id, std::uint32_t keep, Reach reach);
/// Each packet is lost with probability `ratio`, resends too; the same packets for the same seed.
[[nodiscard]] PacketFault lose_ratio(double ratio, std::uint64_t seed);
[[nodiscard]] PacketFault duplicate_all();
[[nodiscard]] PacketFault swap_pairs();

}  // namespace faults

}  // namespace cyclops::hil
