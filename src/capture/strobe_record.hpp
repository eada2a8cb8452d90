#pragma once
/// What the bench's strobe stand-in sends: one record a packet over an abstract AF_UNIX SOCK_SEQPACKET socket.
///
/// Shared by the two ends. Host byte order: both run on one machine, or the stamps would be of two clocks.
#include <cstdint>
#include <string>

#include <sys/socket.h>
#include <sys/un.h>

#include "base/result.hpp"
#include "capture/fd.hpp"

namespace cyclops {

struct StrobeRecord {
  static constexpr std::uint32_t kRising = 1, kFalling = 2;   // as in <linux/gpio.h>
  static constexpr std::uint32_t kArrival = 3;                // no edge: ts_ns is when the first packet of frame `seq` comes
  std::uint64_t ts_ns{0};   ///< CLOCK_MONOTONIC
  std::uint32_t type{0};
  std::uint32_t line{0};
  std::int64_t seq{-1};     ///< number on its line; -1: the sender imitates the old GPIO interface, which has none
};
static_assert(sizeof(StrobeRecord) == 24);

struct SocketAddress {
  sockaddr_un address{};
  socklen_t length{0};
};

/// kInvalid unless the name begins with @ and fits.
inline Result<SocketAddress> abstract_address(const std::string& name) {
  SocketAddress out;
  if (name.size() < 2 || name[0] != '@' || name.size() > sizeof out.address.sun_path)
    return make_error(ErrorCode::kInvalid, "strobe.socket", "is \"" + name + "\", expected @ and 1 to 107 characters");
  out.address.sun_family = AF_UNIX;
  name.copy(out.address.sun_path + 1, name.size() - 1, 1);
  out.length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  return out;
}

}  // namespace cyclops
