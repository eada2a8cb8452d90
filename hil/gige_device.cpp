#include "hil/gige_device.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cstring>

namespace cyclops::hil {
namespace {

constexpr int kPollMs = 20;

std::uint32_t parse_ipv4(const std::string& text) {
  in_addr a{};
  return inet_pton(AF_INET, text.c_str(), &a) == 1 ? ntohl(a.s_addr) : 0;
}
sockaddr_in socket_address(std::uint32_t address, std::uint16_t port) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_addr.s_addr = htonl(address);
  a.sin_port = htons(port);
  return a;
}
/// An UDP socket bound to address:port, or -1 with errno.
int bound_socket(std::uint32_t address, std::uint16_t port) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return -1;
  const sockaddr_in a = socket_address(address, port);
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&a), sizeof a) == 0) return fd;
  const int why = errno;
  ::close(fd);
  errno = why;
  return -1;
}

}  // namespace

std::int64_t monotonic_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}
void sleep_until_ns(std::int64_t deadline_ns) {
  const timespec t{deadline_ns / 1'000'000'000, deadline_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {}
}

GigeDevice::GigeDevice(const GigeConfig& config)
    : config_(config),
      address_(parse_ipv4(config.address)),
      clock_(monotonic_ns),
      registers_(config, address_),
      ring_(config.resend_frames),
      resend_limit_(config.resend_packets_per_s) {}

GigeDevice::~GigeDevice() { stop(); }

Result<> GigeDevice::check_config() const {
  const auto bad = [&](const std::string& what) { return make_error(ErrorCode::kInvalid, "gige device " + config_.address, what); };
  if (!is_local_address(address_)) return bad("address is not an IPv4 loopback or private one");
  if (config_.max_width > kMaxImageSide || config_.max_height > kMaxImageSide) return bad("sensor is larger than 4096 px");
  if (config_.width < 1 || config_.width > config_.max_width) return bad("width is " + std::to_string(config_.width));
  if (config_.height < 1 || config_.height > config_.max_height) return bad("height is " + std::to_string(config_.height));
  if (config_.max_packet_bytes < 576 || config_.max_packet_bytes > 16'000 || config_.max_packet_bytes % 4 != 0)
    return bad("max_packet_bytes is " + std::to_string(config_.max_packet_bytes) + ", expected a multiple of 4 in [576, 16000]");
  if (config_.pacing.packets_per_batch < 1 || config_.pacing.packets_per_batch > 64 || config_.pacing.gap.ns < 0)
    return bad("pacing is out of range");
  if (config_.tick_hz == 0) return bad("tick_hz is 0");
  return Ok{};
}

Result<> GigeDevice::open_sockets() {
  const int stream = bound_socket(address_, 0);
  const int control = stream < 0 ? -1 : bound_socket(address_, kGvcpPort);
  if (control < 0) {
    const std::string why = std::strerror(errno);
    if (stream >= 0) ::close(stream);
    return make_error(ErrorCode::kIo, "gige device " + config_.address + ":" + std::to_string(kGvcpPort), "cannot be bound: " + why);
  }
  const int never_fragment = IP_PMTUDISC_DO;
  (void)::setsockopt(stream, IPPROTO_IP, IP_MTU_DISCOVER, &never_fragment, sizeof never_fragment);
  sockaddr_in own{};
  socklen_t n = sizeof own;
  (void)::getsockname(stream, reinterpret_cast<sockaddr*>(&own), &n);
  const std::lock_guard lock(mutex_);
  control_fd_ = control;
  stream_fd_ = stream;
  registers_.set_source_port(ntohs(own.sin_port));
  return Ok{};
}

void GigeDevice::close_sockets() {
  for (int* fd : {&control_fd_, &stream_fd_}) {
    if (*fd >= 0) ::close(*fd);
    *fd = -1;
  }
}

Result<> GigeDevice::start() {
  CYCLOPS_ASSERT(!thread_.joinable());
  CYCLOPS_TRY(check_config());
  CYCLOPS_TRY(open_sockets());
  stopping_ = false;
  thread_ = std::thread([this] { control_loop(); });
  return Ok{};
}

void GigeDevice::stop() {
  if (!thread_.joinable()) return;
  stopping_ = true;
  thread_.join();
  const std::lock_guard lock(mutex_);
  close_sockets();
  registers_.power_on();
  streaming_ = false;
}

bool GigeDevice::wait_streaming(Duration timeout) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return streaming_.load(); });
}

void GigeDevice::set_fault(PacketFault fault) {
  const std::lock_guard lock(mutex_);
  fault_ = std::move(fault);
}

void GigeDevice::vanish(Outage outage) {
  const std::lock_guard lock(mutex_);  // the control thread polls outside the lock, on a copy of the descriptor
  gone_ = true;
  close_sockets();
  if (outage == Outage::kPower) {
    registers_.power_on();
    ring_.forget();
    streaming_ = false;
  }
}

Result<> GigeDevice::reappear() {
  CYCLOPS_TRY(open_sockets());
  const std::lock_guard lock(mutex_);
  gone_ = false;
  return Ok{};
}

void GigeDevice::change_settings(std::optional<double> exposure_us, std::optional<double> frame_rate_hz) {
  const std::lock_guard lock(mutex_);
  if (exposure_us) registers_.set_float(reg::kExposure, *exposure_us);
  if (frame_rate_hz) registers_.set_float(reg::kFrameRate, *frame_rate_hz);
}

GigeStats GigeDevice::stats() const {
  const std::lock_guard lock(mutex_);
  return stats_;
}

GigeSettings GigeDevice::settings() const {
  const std::lock_guard lock(mutex_);
  GigeSettings s;
  s.width = static_cast<int>(registers_.value(reg::kWidth));
  s.height = static_cast<int>(registers_.value(reg::kHeight));
  for (PixelFormat f : {PixelFormat::kMono8, PixelFormat::kMono10, PixelFormat::kMono12, PixelFormat::kMono16})
    if (pfnc(f) == registers_.value(reg::kPixelFormat)) s.format = f;
  s.frame_rate_hz = std::bit_cast<float>(registers_.value(reg::kFrameRate));
  s.exposure_us = std::bit_cast<float>(registers_.value(reg::kExposure));
  s.packet_bytes = registers_.target().packet_bytes;
  return s;
}

void GigeDevice::control_loop() {
  while (!stopping_) {
    pollfd p{-1, POLLIN, 0};
    {
      const std::lock_guard lock(mutex_);
      p.fd = control_fd_;
    }
    if (::poll(&p, 1, kPollMs) > 0) receive_one();
    {
      const std::lock_guard lock(mutex_);
      if (registers_.expire(monotonic_ns())) ++stats_.control_lost;
    }
    announce();
  }
}

void GigeDevice::receive_one() {
  std::array<std::uint8_t, 2048> packet;
  sockaddr_in from{};
  socklen_t n = sizeof from;
  GvcpReply reply;
  GvcpPeer peer;
  {
    const std::lock_guard lock(mutex_);
    if (control_fd_ < 0) return;
    const ssize_t got = ::recvfrom(control_fd_, packet.data(), packet.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &n);
    if (got < 0) return;
    peer = {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
    if (!is_local_address(peer.address)) return;
    const std::span bytes(packet.data(), static_cast<std::size_t>(got));
    reply = handle_gvcp(registers_, bytes, peer, monotonic_ns(), tick_of(clock_()));
    ++stats_.commands;
    if (reply.malformed) ++stats_.malformed;
    else if (reply.status != GvcpStatus::kSuccess) ++stats_.refused_commands;
    if (!reply.bytes.empty() &&
        ::sendto(control_fd_, reply.bytes.begin(), reply.bytes.size(), MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&from), n) < 0)
      ++stats_.send_errors;
  }
  after(reply.effects);
}

void GigeDevice::after(const GvcpEffects& effects) {
  if (effects.fire_test_packet) fire_test_packet();
  if (effects.acquisition_changed) announce();
  if (effects.resend) resend(*effects.resend);
}

void GigeDevice::announce() {
  bool now = false;
  {
    const std::lock_guard lock(mutex_);
    now = registers_.acquiring() && !gone_;
    streaming_ = now;
  }
  if (now == announced_) return;
  announced_ = now;
  changed_.notify_all();
  if (on_acquisition_) on_acquisition_(now);
}

}  // namespace cyclops::hil
