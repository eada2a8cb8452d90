#include "hil/strobe_server.hpp"

#include <cerrno>
#include <cstring>

namespace cyclops::hil {
namespace {

enum class Sent { kYes, kFull, kGone };

Sent send_record(int fd, const StrobeRecord& record) {
  for (;;) {
    if (::send(fd, &record, sizeof record, MSG_DONTWAIT | MSG_NOSIGNAL) == sizeof record) return Sent::kYes;
    if (errno == EINTR) continue;
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS ? Sent::kFull : Sent::kGone;
  }
}

}  // namespace

Result<StrobeServer> StrobeServer::open(const std::string& name) {
  auto address = abstract_address(name);
  if (!address) return address.error();
  StrobeServer server;
  server.listener_ = Fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!server.listener_.open()) return make_error(ErrorCode::kIo, name, std::string("socket: ") + std::strerror(errno));
  if (::bind(server.listener_.get(), reinterpret_cast<const sockaddr*>(&address->address), address->length) != 0 || ::listen(server.listener_.get(), 8) != 0)
    return make_error(ErrorCode::kIo, name, std::string("listen: ") + std::strerror(errno));
  return server;
}

void StrobeServer::accept_waiting() {
  for (;;) {
    Fd client(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!client.open()) return;
    clients_.push_back(std::move(client));
    ++counters_.clients;
  }
}

void StrobeServer::send(const StrobeEdge& edge, std::uint32_t line) {
  accept_waiting();
  ++counters_.edges;
  if (clients_.empty()) ++counters_.no_client;
  send_all({static_cast<std::uint64_t>(edge.t.ns), edge.rising ? StrobeRecord::kRising : StrobeRecord::kFalling, line, edge.line_seq});
}

void StrobeServer::send_arrival(std::uint64_t camera_frame_id, Time t) {
  accept_waiting();
  send_all({static_cast<std::uint64_t>(t.ns), StrobeRecord::kArrival, 0, static_cast<std::int64_t>(camera_frame_id)});
}

void StrobeServer::send_all(const StrobeRecord& record) {
  for (std::size_t i = 0; i < clients_.size();) {
    const Sent sent = send_record(clients_[i].get(), record);
    if (sent == Sent::kYes) ++counters_.delivered;
    if (sent == Sent::kFull) ++counters_.undelivered;
    if (sent != Sent::kGone) { ++i; continue; }
    ++counters_.gone;
    clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace cyclops::hil
