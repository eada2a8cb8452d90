#include "hil/gige_faults.hpp"

#include <utility>

#include "hil/dice.hpp"

namespace cyclops::hil::faults {
namespace {

template <class Which>
PacketFault drop_if(std::uint64_t block_id, Reach reach, Which which) {
  return [=](const PacketRef& p) {
    const bool hit = p.block_id == block_id && (reach == Reach::kForEver || !p.again) && which(p);
    return hit ? PacketFate::kDrop : PacketFate::kSend;
  };
}

}  // namespace

PacketFault drop_packets(std::uint64_t block_id, std::set<std::uint32_t> packets, Reach reach) {
  return drop_if(block_id, reach, [packets = std::move(packets)](const PacketRef& p) { return packets.count(p.packet_id) != 0; });
}
PacketFault drop_leader(std::uint64_t block_id, Reach reach) { return drop_packets(block_id, {0}, reach); }
PacketFault drop_trailer(std::uint64_t block_id, Reach reach) {
  return drop_if(block_id, reach, [](const PacketRef& p) { return p.packet_id == p.count - 1; });
}
PacketFault drop_frame(std::uint64_t block_id) {
  return drop_if(block_id, Reach::kForEver, [](const PacketRef&) { return true; });
}
PacketFault truncate(std::uint64_t block_id, std::uint32_t keep, Reach reach) {
  return drop_if(block_id, reach, [keep](const PacketRef& p) { return p.packet_id >= keep; });
}
PacketFault lose_ratio(double ratio, std::uint64_t seed) {
  return [=, turn = std::uint64_t{0}](const PacketRef& p) mutable {
    const std::uint64_t x = seed ^ (p.block_id << 24) ^ p.packet_id ^ (p.again ? ++turn << 48 : 0);
    return dice(x) < ratio ? PacketFate::kDrop : PacketFate::kSend;
  };
}
PacketFault duplicate_all() {
  return [](const PacketRef&) { return PacketFate::kTwice; };
}
PacketFault swap_pairs() {
  return [](const PacketRef& p) {
    return !p.again && p.packet_id % 2 == 1 && p.packet_id + 2 < p.count ? PacketFate::kSwap : PacketFate::kSend;
  };
}

}  // namespace cyclops::hil::faults
