// The sending half of GigeDevice: frames, resends and the packet-size test.
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>

#include "hil/gige_device.hpp"

namespace cyclops::hil {
namespace {

constexpr std::size_t kMaxBatch = 64;

}  // namespace

std::uint64_t GigeDevice::tick_of(std::int64_t ns) const {
  return static_cast<std::uint64_t>(static_cast<unsigned __int128>(std::max<std::int64_t>(ns, 0)) * config_.tick_hz / 1'000'000'000U);
}

GigeDevice::Stream GigeDevice::stream_now() const {
  const StreamTarget t = registers_.target();
  return {{config_.extended_ids, t.packet_bytes}, t.address, t.port};
}

SendReport GigeDevice::send(const FrameToSend& frame, std::int64_t deadline_ns) {
  CYCLOPS_ASSERT(frame.block_id != 0 && frame.image.data != nullptr);
  Stream to;
  const KeptFrame* kept = nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (!registers_.acquiring() || stream_fd_ < 0) {
      ++stats_.frames_refused;
      return {};
    }
    to = stream_now();
    kept = keep(frame, to);
    plan(*kept, 0, to.layout.packets(kept->image.size()) - 1, false, send_order_);
  }
  Pacer pacer(deadline_ns > 0 ? deadline_ns : monotonic_ns(), config_.pacing);
  SendReport report;
  report.sent = transmit(*kept, to, pacer, report.late);
  const std::lock_guard lock(mutex_);
  ++(report.sent ? stats_.frames_sent : stats_.frames_refused);
  stats_.reanchored += pacer.reanchored();
  stats_.max_late = std::max(stats_.max_late, report.late);
  return report;
}

KeptFrame* GigeDevice::keep(const FrameToSend& frame, const Stream& to) {
  const ImageView& image = frame.image;
  const std::size_t row = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(bytes_per_pixel(image.format));
  KeptFrame& kept = ring_.replace();
  kept.layout = to.layout;
  kept.leader = {tick_of(frame.timestamp_ns), pfnc(image.format), static_cast<std::uint32_t>(image.width),
                 static_cast<std::uint32_t>(image.height)};
  kept.image.resize(row * static_cast<std::size_t>(image.height));
  for (int v = 0; v < image.height; ++v) std::memcpy(&kept.image[row * static_cast<std::size_t>(v)], image.row8(v), row);
  kept.wire_id = to.layout.wire_id(frame.block_id);
  return &kept;
}

/// The packets first..last in the order in which they leave, after the faults.
void GigeDevice::plan(const KeptFrame& frame, std::uint32_t first, std::uint32_t last, bool again, std::vector<std::uint32_t>& order) {
  order.clear();
  const std::uint32_t count = frame.layout.packets(frame.image.size());
  bool swapped = false;
  std::uint32_t held = 0;
  for (std::uint32_t id = first; id <= last; ++id) {
    const PacketFate fate = fault_ ? fault_({frame.wire_id, id, count, again}) : PacketFate::kSend;
    if (fate == PacketFate::kSwap && id != last && !swapped) {
      swapped = true;
      held = id;
      continue;
    }
    if (fate != PacketFate::kDrop) order.push_back(id);
    if (fate == PacketFate::kTwice) order.push_back(id);
    if (swapped) order.push_back(held);
    swapped = false;
  }
}

bool GigeDevice::transmit(const KeptFrame& frame, const Stream& to, Pacer& pacer, Duration& late) {
  const auto batch = static_cast<std::size_t>(config_.pacing.packets_per_batch);
  const std::int64_t start = pacer.due();
  std::int64_t left = start, planned = start;
  for (std::size_t i = 0; i < send_order_.size(); i += batch) {
    sleep_until_ns(pacer.due());
    left = monotonic_ns();
    (void)pacer.leave(left);
    planned = start + static_cast<std::int64_t>(i / batch) * config_.pacing.gap.ns;
    const std::lock_guard lock(mutex_);
    if (!registers_.acquiring() || stream_fd_ < 0) return false;
    send_batch(to, frame, std::span(send_order_).subspan(i, std::min(batch, send_order_.size() - i)), 0);
  }
  late = {std::max<std::int64_t>(0, left - planned)};
  return true;
}

void GigeDevice::send_batch(const Stream& to, const KeptFrame& frame, std::span<const std::uint32_t> ids, std::uint16_t status) {
  std::array<GvspPacket, kMaxBatch> packets;
  for (std::size_t i = 0; i < ids.size(); ++i)
    make_packet(frame.layout, frame.wire_id, ids[i], status, frame.leader, frame.image, packets[i]);
  send_packets(to, std::span(packets).first(ids.size()));
}

void GigeDevice::send_packets(const Stream& to, std::span<const GvspPacket> packets) {
  if (to.port == 0 || !is_local_address(to.address)) return;
  sockaddr_in target{};
  target.sin_family = AF_INET;
  target.sin_addr.s_addr = htonl(to.address);
  target.sin_port = htons(to.port);
  std::array<iovec, 2 * kMaxBatch> parts{};
  std::array<mmsghdr, kMaxBatch> messages{};
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const GvspPacket& p = packets[i];
    parts[2 * i] = {const_cast<std::uint8_t*>(p.head.data()), p.head_bytes};
    parts[2 * i + 1] = {const_cast<std::uint8_t*>(p.body.data()), p.body.size()};
    messages[i].msg_hdr = {&target, sizeof target, &parts[2 * i], p.body.empty() ? 1U : 2U, nullptr, 0, 0};
    stats_.bytes += p.head_bytes + p.body.size();
  }
  const int sent = ::sendmmsg(stream_fd_, messages.data(), static_cast<unsigned>(packets.size()), 0);
  const auto good = static_cast<std::uint64_t>(std::max(sent, 0));
  stats_.packets += good;
  stats_.send_errors += packets.size() - good;
}

void GigeDevice::fire_test_packet() {
  const std::lock_guard lock(mutex_);
  const Stream to = stream_now();
  if (stream_fd_ < 0) return;
  std::array<std::uint8_t, 16'000> zeros{};
  GvspPacket p;
  p.head_bytes = 8;
  p.body = std::span(zeros).first(static_cast<std::size_t>(to.layout.packet_bytes - 28 - 8));
  send_packets(to, {&p, 1});
  ++stats_.test_packets;
}

/// In paced batches like a frame; what the rate limit does not allow is left for the client to ask again.
void GigeDevice::resend(const ResendRequest& request) {
  Pacer pacer(monotonic_ns(), config_.pacing);
  std::size_t done = 0, batch = 0;
  do {
    if (done != 0) sleep_until_ns(pacer.due());
    (void)pacer.leave(monotonic_ns());
    const std::lock_guard lock(mutex_);
    const Stream to = stream_now();
    if (stream_fd_ < 0 || !registers_.acquiring()) return;
    const KeptFrame* frame = request.extended == to.layout.extended ? ring_.find(request.block_id) : nullptr;
    const std::uint32_t count = frame != nullptr ? frame->layout.packets(frame->image.size()) : 0;
    if (done == 0) {
      ++stats_.resend_requests;
      if (frame == nullptr || request.first >= count) return refuse_resend(request, request.first);
      const std::uint32_t last = std::min(request.last, count - 1);
      const std::uint32_t wanted = last - request.first + 1;
      const std::uint32_t given = resend_limit_.take(wanted, monotonic_ns());
      stats_.resend_limited += wanted - given;
      if (given == 0) return;
      plan(*frame, request.first, request.first + given - 1, true, resend_order_);
    } else if (frame == nullptr) {
      return;  // replaced by a newer frame on the way
    }
    batch = std::min(static_cast<std::size_t>(config_.pacing.packets_per_batch), resend_order_.size() - done);
    send_batch(to, *frame, std::span(resend_order_).subspan(done, batch), kGvspResent);
    stats_.resent_packets += batch;
    done += batch;
  } while (done < resend_order_.size());
}

void GigeDevice::refuse_resend(const ResendRequest& request, std::uint32_t packet_id) {
  ++stats_.resend_unknown;
  const Stream to = stream_now();
  if (request.extended != to.layout.extended) return;
  GvspPacket p;
  make_refusal(to.layout, request.block_id, packet_id, static_cast<std::uint16_t>(GvcpStatus::kPacketUnavailable), p);
  send_packets(to, {&p, 1});
}

}  // namespace cyclops::hil
