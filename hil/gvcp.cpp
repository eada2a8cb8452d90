#include "hil/gvcp.hpp"

#include <algorithm>
#include <array>

#include "hil/gige_registers.hpp"

namespace cyclops::hil {
namespace {

constexpr std::uint8_t kKey = 0x42;
constexpr std::uint8_t kAckWanted = 0x01;
constexpr std::uint8_t kExtendedIds = 0x10;
constexpr std::uint32_t kMaxMemory = 536;

struct Request {
  std::uint8_t flags{0};
  std::uint16_t command{0};
  std::uint16_t id{0};
  std::span<const std::uint8_t> body;
  GvcpPeer peer;
  std::int64_t now_ns{0};
  std::uint64_t tick{0};
};

void append(GvcpReply& reply, std::span<const std::uint8_t> bytes) {
  for (std::uint8_t b : bytes) reply.bytes.push_back(b);
}
void append_be32(GvcpReply& reply, std::uint32_t v) {
  std::array<std::uint8_t, 4> b{};
  put_be32(b.data(), v);
  append(reply, b);
}

void header(GvcpReply& reply, const Request& q, GvcpStatus status) {
  reply.bytes.clear();
  reply.bytes.resize(kGvcpHeader);
  reply.status = status;
  put_be16(&reply.bytes[0], static_cast<std::uint16_t>(status));
  put_be16(&reply.bytes[2], static_cast<std::uint16_t>(q.command + 1));
  put_be16(&reply.bytes[4], 0);
  put_be16(&reply.bytes[6], q.id);
}
void finish(GvcpReply& reply, const Request& q) {
  if (reply.bytes.empty()) return;
  put_be16(&reply.bytes[4], static_cast<std::uint16_t>(reply.bytes.size() - kGvcpHeader));
  if ((q.flags & kAckWanted) == 0) reply.bytes.clear();
}
void refuse(GvcpReply& reply, const Request& q, GvcpStatus status) { header(reply, q, status); }
void refuse_malformed(GvcpReply& reply, const Request& q, GvcpStatus status = GvcpStatus::kInvalidHeader) {
  reply.malformed = true;
  refuse(reply, q, status);
}

void discovery(GigeRegisters& r, const Request& q, GvcpReply& reply) {
  if (!q.body.empty()) return refuse_malformed(reply, q);
  header(reply, q, GvcpStatus::kSuccess);
  std::array<std::uint8_t, kDiscoveryBytes> data{};
  CYCLOPS_ASSERT(r.read(0, data) == GvcpStatus::kSuccess);
  append(reply, data);
}

void read_register(GigeRegisters& r, const Request& q, GvcpReply& reply) {
  if (q.body.empty() || q.body.size() % 4 != 0 || q.body.size() > kGvcpMaxPayload) return refuse_malformed(reply, q);
  header(reply, q, GvcpStatus::kSuccess);
  for (std::size_t i = 0; i < q.body.size(); i += 4) {
    std::array<std::uint8_t, 4> value{};
    const GvcpStatus status = r.read(get_be32(&q.body[i]), value);
    if (status != GvcpStatus::kSuccess) return refuse(reply, q, status);
    append(reply, value);
  }
}

void write_register(GigeRegisters& r, const Request& q, GvcpReply& reply) {
  if (q.body.empty() || q.body.size() % 8 != 0 || q.body.size() > kGvcpMaxPayload) return refuse_malformed(reply, q);
  std::uint32_t done = 0;
  GvcpStatus status = GvcpStatus::kSuccess;
  for (std::size_t i = 0; i < q.body.size() && status == GvcpStatus::kSuccess; i += 8) {
    status = r.write(get_be32(&q.body[i]), get_be32(&q.body[i + 4]), {q.peer, q.now_ns, q.tick}, reply.effects);
    if (status == GvcpStatus::kSuccess) ++done;
  }
  header(reply, q, status);
  append_be32(reply, done);
}

void read_memory(GigeRegisters& r, const Request& q, GvcpReply& reply) {
  if (q.body.size() != 8) return refuse_malformed(reply, q);
  const std::uint32_t address = get_be32(&q.body[0]);
  const std::uint32_t count = get_be16(&q.body[6]);
  if (count == 0 || count > kMaxMemory) return refuse_malformed(reply, q, GvcpStatus::kInvalidParameter);
  std::array<std::uint8_t, kMaxMemory> data{};
  const GvcpStatus status = r.read(address, std::span(data).first(count));
  if (status != GvcpStatus::kSuccess) return refuse(reply, q, status);
  header(reply, q, status);
  append_be32(reply, address);
  append(reply, std::span(data).first(count));
}

void write_memory(GigeRegisters& r, const Request& q, GvcpReply& reply) {
  if (q.body.size() < 8 || q.body.size() % 4 != 0 || q.body.size() > kGvcpMaxPayload) return refuse_malformed(reply, q);
  const std::uint32_t address = get_be32(&q.body[0]);
  std::uint32_t done = 0;
  GvcpStatus status = GvcpStatus::kSuccess;
  for (std::uint32_t i = 4; i < q.body.size() && status == GvcpStatus::kSuccess; i += 4) {
    status = r.write(address + (i - 4), get_be32(&q.body[i]), {q.peer, q.now_ns, q.tick}, reply.effects);
    if (status == GvcpStatus::kSuccess) done += 4;
  }
  header(reply, q, status);
  append_be32(reply, done);
}

void packet_resend(GigeRegisters& r, const Request& q, GvcpReply& reply) {
  const bool extended = (q.flags & kExtendedIds) != 0;
  if (q.body.size() != (extended ? 20U : 12U) || get_be16(&q.body[0]) != 0) return refuse_malformed(reply, q);
  if (!r.may_resend(q.peer)) return refuse(reply, q, GvcpStatus::kAccessDenied);
  const std::uint32_t mask = extended ? 0xffffffffU : 0xffffffU;
  ResendRequest request{.block_id = extended ? get_be64(&q.body[12]) : get_be16(&q.body[2]),
                        .first = get_be32(&q.body[4]) & mask,
                        .last = get_be32(&q.body[8]) & mask,
                        .extended = extended};
  if (request.first > request.last || request.block_id == 0)
    return refuse_malformed(reply, q, GvcpStatus::kInvalidParameter);
  reply.effects.resend = request;  // answered by packets on the stream, not by an acknowledge
}

void dispatch(GigeRegisters& r, const Request& q, GvcpReply& reply) {
  switch (static_cast<GvcpCommand>(q.command)) {
    case GvcpCommand::kDiscovery: return discovery(r, q, reply);
    case GvcpCommand::kReadRegister: return read_register(r, q, reply);
    case GvcpCommand::kWriteRegister: return write_register(r, q, reply);
    case GvcpCommand::kReadMemory: return read_memory(r, q, reply);
    case GvcpCommand::kWriteMemory: return write_memory(r, q, reply);
    case GvcpCommand::kPacketResend: return packet_resend(r, q, reply);
  }
  refuse(reply, q, GvcpStatus::kNotImplemented);
}

/// Commands that exclusive access of another application does not hide; resend has a rule of its own.
bool always_open(std::uint16_t command) {
  return command == static_cast<std::uint16_t>(GvcpCommand::kDiscovery) ||
         command == static_cast<std::uint16_t>(GvcpCommand::kPacketResend);
}

}  // namespace

GvcpReply handle_gvcp(GigeRegisters& registers, std::span<const std::uint8_t> packet, GvcpPeer peer, std::int64_t now_ns,
                      std::uint64_t tick) {
  GvcpReply reply;
  if (packet.size() < kGvcpHeader || packet[0] != kKey) {
    reply.malformed = true;
    return reply;
  }
  Request q{packet[1], get_be16(&packet[2]), get_be16(&packet[6]), packet.subspan(kGvcpHeader), peer, now_ns, tick};
  if (get_be16(&packet[4]) != q.body.size() || q.id == 0) refuse_malformed(reply, q);
  else if (!always_open(q.command) && registers.hidden_from(peer))
    refuse(reply, q, GvcpStatus::kAccessDenied);
  else {
    registers.heard(peer, now_ns);
    dispatch(registers, q, reply);
  }
  finish(reply, q);
  return reply;
}

}  // namespace cyclops::hil
