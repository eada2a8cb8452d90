#include "capture/gvcp_probe.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace cyclops {
namespace {

constexpr std::uint16_t kPort = 3956;
constexpr std::size_t kHeader = 8, kAnswer = 0xf8;
constexpr std::array<std::uint8_t, kHeader> kDiscovery{0x42, 0x01, 0, 0x02, 0, 0, 0, 1};

struct Socket {
  int fd{::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
  ~Socket() { if (fd >= 0) ::close(fd); }
};

std::string text(const std::uint8_t* p, std::size_t room) {
  const char* s = reinterpret_cast<const char*>(p);
  return {s, ::strnlen(s, room)};
}

std::string local_address(int fd) {
  sockaddr_in own{};
  socklen_t n = sizeof own;
  char out[INET_ADDRSTRLEN] = "";
  if (::getsockname(fd, reinterpret_cast<sockaddr*>(&own), &n) == 0) ::inet_ntop(AF_INET, &own.sin_addr, out, sizeof out);
  return out;
}

}  // namespace

Result<CameraFound> probe_camera(const std::string& address, Duration timeout) {
  const std::string where = "camera " + address;
  sockaddr_in target{};
  target.sin_family = AF_INET;
  target.sin_port = htons(kPort);
  if (::inet_pton(AF_INET, address.c_str(), &target.sin_addr) != 1)
    return make_error(ErrorCode::kInvalid, where, "is not an IPv4 address");
  const Socket s;
  if (s.fd < 0 || ::connect(s.fd, reinterpret_cast<const sockaddr*>(&target), sizeof target) != 0)
    return make_error(ErrorCode::kIo, where, std::string("cannot be reached: ") + std::strerror(errno));
  const auto nobody = [&] {
    return make_error(ErrorCode::kNotFound, where,
                      "no GigE Vision device answers on port 3956 within " + std::to_string(timeout.ns / 1'000'000) + " ms");
  };
  if (::send(s.fd, kDiscovery.data(), kDiscovery.size(), 0) < 0) return nobody();
  pollfd p{s.fd, POLLIN, 0};
  if (::poll(&p, 1, static_cast<int>(timeout.ns / 1'000'000)) <= 0) return nobody();
  std::array<std::uint8_t, 1024> answer{};
  const ssize_t n = ::recv(s.fd, answer.data(), answer.size(), MSG_DONTWAIT);
  if (n < 0) return nobody();  // the port is closed: the network says so
  if (static_cast<std::size_t>(n) < kHeader + kAnswer || answer[2] != 0 || answer[3] != 0x03)
    return make_error(ErrorCode::kCorrupt, where, "answers on port 3956, but not as a GigE Vision device");
  const std::uint8_t* data = answer.data() + kHeader;
  return CameraFound{local_address(s.fd), text(data + 0x48, 32), text(data + 0x68, 32), text(data + 0xd8, 16)};
}

}  // namespace cyclops
