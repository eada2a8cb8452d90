// Strobe edges from the bench's stand-in. The server may come later, go away and come back.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include <poll.h>

#include "base/static_vector.hpp"
#include "capture/strobe_record.hpp"
#include "capture/strobe_source.hpp"

namespace cyclops {
namespace {

constexpr std::int64_t kRetry_ns = 20'000'000;

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

int whole_ms(std::int64_t ns) { return static_cast<int>(std::max<std::int64_t>((ns + 999'999) / 1'000'000, 0)); }

class SocketStrobe final : public StrobeSource {
 public:
  explicit SocketStrobe(const StrobeConfig& config) : config_(config) {}

  Result<> open() override {
    auto address = abstract_address(config_.socket);
    if (!address) return address.error();
    address_ = *address;
    fd_.reset();
    status_.connected = false;
    return connect_once();
  }

  Result<bool> wait(Duration timeout) override {
    const std::int64_t end = now_ns() + timeout.ns;
    for (;;) {
      if (!fd_.open()) CYCLOPS_TRY(connect_once());
      const std::int64_t left = end - now_ns();
      pollfd p{fd_.get(), POLLIN, 0};   // poll skips a negative descriptor and only sleeps
      const int n = ::poll(&p, 1, whole_ms(fd_.open() ? left : std::min(left, kRetry_ns)));
      if (n < 0 && errno != EINTR) return failed("poll");
      if (n > 0 && !gone()) return true;
      if (now_ns() >= end) return false;
    }
  }

  Result<std::size_t> read_many(std::span<StrobeEdge> out) override {
    std::size_t n = 0;
    while (n < out.size() && fd_.open()) {
      StrobeRecord r;
      const ssize_t got = ::recv(fd_.get(), &r, sizeof r, MSG_DONTWAIT | MSG_TRUNC);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
      if (got <= 0) { disconnected(); break; }
      if (take(r, static_cast<std::size_t>(got), out[n])) ++n;
    }
    status_.edges += n;
    return n;
  }

  [[nodiscard]] StrobeStatus status() const override { return status_; }
  [[nodiscard]] bool has_own_clock() const override { return true; }

  std::size_t take_arrivals(std::span<FrameArrival> out) override {
    const std::size_t n = std::min(out.size(), arrivals_.size());
    std::copy_n(arrivals_.begin(), n, out.begin());
    arrivals_.clear();
    return n;
  }

 private:
  [[nodiscard]] Error failed(const char* call) const {
    return make_error(ErrorCode::kIo, config_.socket, std::string(call) + ": " + std::strerror(errno));
  }

  Result<> connect_once() {
    Fd fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!fd.open()) return failed("socket");
    if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address_.address), address_.length) != 0) {
      if (errno == ECONNREFUSED || errno == EAGAIN || errno == ENOENT || errno == EINTR) return Ok{};   // not there yet
      return failed("connect");
    }
    fd_ = std::move(fd);
    last_seq_ = -1;
    status_.connected = true;
    return Ok{};
  }

  // True, and closed, when the server has hung up and nothing it sent is left.
  bool gone() {
    char byte = 0;
    const ssize_t n = ::recv(fd_.get(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (n > 0 || (n < 0 && (errno == EAGAIN || errno == EINTR))) return false;
    disconnected();
    return true;
  }

  void disconnected() {
    fd_.reset();
    status_.connected = false;
    ++status_.disconnects;
  }

  bool take(const StrobeRecord& r, std::size_t size, StrobeEdge& out) {
    if (size == sizeof r && r.type == StrobeRecord::kArrival && r.seq >= 0) {
      if (!arrivals_.try_push_back({static_cast<std::uint64_t>(r.seq), Time{static_cast<std::int64_t>(r.ts_ns)}})) ++status_.malformed;
      return false;
    }
    if (size != sizeof r || (r.type != StrobeRecord::kRising && r.type != StrobeRecord::kFalling)) { ++status_.malformed; return false; }
    const bool rising = r.type == StrobeRecord::kRising;
    if (r.line != static_cast<std::uint32_t>(config_.line) || rising != config_.rising) { ++status_.foreign; return false; }
    if (r.seq >= 0 && last_seq_ >= 0 && r.seq > last_seq_ + 1) status_.lost += static_cast<std::uint64_t>(r.seq - last_seq_ - 1);
    last_seq_ = r.seq;
    status_.numbered = r.seq >= 0;
    out = {Time{static_cast<std::int64_t>(r.ts_ns)}, r.seq, rising};
    return true;
  }

  StrobeConfig config_;
  SocketAddress address_;
  Fd fd_;
  StrobeStatus status_;
  std::int64_t last_seq_{-1};
  StaticVector<FrameArrival, 64> arrivals_{};
};

}  // namespace

std::unique_ptr<StrobeSource> make_socket_strobe(const StrobeConfig& config) { return std::make_unique<SocketStrobe>(config); }

}  // namespace cyclops
