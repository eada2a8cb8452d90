#include "hil/gvsp.hpp"

#include <algorithm>

#include "base/result.hpp"
#include "hil/gvcp.hpp"

namespace cyclops::hil {
namespace {

constexpr std::uint16_t kPayloadImage = 1;

void make_header(const GvspLayout& layout, std::uint64_t wire_id, std::uint32_t packet_id, std::uint16_t status,
                 GvspContent content, GvspPacket& out) {
  std::uint8_t* p = out.head.data();
  put_be16(p, status);
  if (layout.extended) {
    put_be16(p + 2, 0);
    put_be32(p + 4, (0x80U | static_cast<std::uint32_t>(content)) << 24);
    put_be64(p + 8, wire_id);
    put_be32(p + 16, packet_id);
  } else {
    put_be16(p + 2, static_cast<std::uint16_t>(wire_id));
    put_be32(p + 4, static_cast<std::uint32_t>(content) << 24 | (packet_id & 0xffffffU));
  }
  out.head_bytes = static_cast<std::size_t>(layout.header_bytes());
  out.body = {};
}

void add_leader(const GvspLeader& leader, GvspPacket& out) {
  std::uint8_t* p = out.head.data() + out.head_bytes;
  std::fill(p, p + 36, std::uint8_t{0});
  put_be16(p + 2, kPayloadImage);
  put_be64(p + 4, leader.tick);
  put_be32(p + 12, leader.pixel_format);
  put_be32(p + 16, leader.width);
  put_be32(p + 20, leader.height);
  out.head_bytes += 36;
}

void add_trailer(const GvspLeader& leader, GvspPacket& out) {
  std::uint8_t* p = out.head.data() + out.head_bytes;
  put_be32(p, kPayloadImage);
  put_be32(p + 4, leader.height);
  out.head_bytes += 8;
}

}  // namespace

void make_packet(const GvspLayout& layout, std::uint64_t wire_id, std::uint32_t packet_id, std::uint16_t status,
                 const GvspLeader& leader, std::span<const std::uint8_t> image, GvspPacket& out) {
  const std::uint32_t count = layout.packets(image.size());
  CYCLOPS_ASSERT(packet_id < count);
  const GvspContent content = packet_id == 0           ? GvspContent::kLeader
                              : packet_id == count - 1 ? GvspContent::kTrailer
                                                       : GvspContent::kPayload;
  make_header(layout, wire_id, packet_id, status, content, out);
  if (content == GvspContent::kLeader) return add_leader(leader, out);
  if (content == GvspContent::kTrailer) return add_trailer(leader, out);
  const auto room = static_cast<std::size_t>(layout.payload_bytes());
  const std::size_t offset = (packet_id - 1) * room;
  out.body = image.subspan(offset, std::min(room, image.size() - offset));
}

void make_refusal(const GvspLayout& layout, std::uint64_t wire_id, std::uint32_t packet_id, std::uint16_t status, GvspPacket& out) {
  make_header(layout, wire_id, packet_id, status, GvspContent::kPayload, out);
}

std::int64_t Pacer::leave(std::int64_t now_ns) {
  const std::int64_t late = std::max<std::int64_t>(0, now_ns - next_ns_);
  if (late > pacing_.reanchor_after.ns) {
    next_ns_ = now_ns;
    ++reanchored_;
  }
  next_ns_ += pacing_.gap.ns;
  return late;
}

std::uint32_t RateLimit::take(std::uint32_t wanted, std::int64_t now_ns) {
  if (started_) tokens_ = std::min(depth(), tokens_ + static_cast<double>(now_ns - last_ns_) * 1e-9 * per_second_);
  started_ = true;
  last_ns_ = now_ns;
  const std::uint32_t given = std::min(wanted, static_cast<std::uint32_t>(std::max(0.0, tokens_)));
  tokens_ -= given;
  return given;
}

KeptFrame& ResendRing::replace() {
  KeptFrame& slot = slots_[next_];
  next_ = (next_ + 1) % slots_.size();
  slot.wire_id = 0;
  return slot;
}

const KeptFrame* ResendRing::find(std::uint64_t wire_id) const {
  for (const KeptFrame& slot : slots_)
    if (slot.wire_id == wire_id && wire_id != 0) return &slot;
  return nullptr;
}

void ResendRing::forget() {
  for (KeptFrame& slot : slots_) slot.wire_id = 0;
}

}  // namespace cyclops::hil
