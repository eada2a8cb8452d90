// Strobe edges from a GPIO line straight through the kernel's interface v2 (5.10 or newer; <linux/gpio.h>), without a library:
// libgpiod 1.6, Debian 12's, knows only v1, which numbers nothing and loses edges silently after 16.
//
//   edge numbers   line_seqno, so that every loss shows        kernel buffer  kBuffer edges, the newest are kept
//   time           CLOCK_MONOTONIC, the default
#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <filesystem>
#include <string>

#include <fcntl.h>
#include <linux/gpio.h>
#include <poll.h>
#include <sys/ioctl.h>

#include "capture/fd.hpp"
#include "capture/gpio_error.hpp"
#include "capture/strobe_source.hpp"

namespace cyclops {
namespace {

constexpr std::uint32_t kBuffer = 1024;   // the kernel's limit for one line
constexpr std::size_t kAtOnce = 64;

Fd open_device(const std::string& path) { return Fd(::open(path.c_str(), O_RDWR | O_CLOEXEC)); }

bool chip_info(const Fd& chip, gpiochip_info& info) {
  info = {};
  return ::ioctl(chip.get(), GPIO_GET_CHIPINFO_IOCTL, &info) == 0;
}

/// By path, name or label. Closed, with errno, when there is none.
Fd open_chip(const std::string& chip) {
  gpiochip_info info;
  Fd fd = open_device(chip.starts_with('/') ? chip : "/dev/" + chip);
  if (fd.open() && chip_info(fd, info)) return fd;
  if (chip.starts_with('/') || errno == EACCES) return Fd();
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored)) {
    if (!entry.path().filename().string().starts_with("gpiochip")) continue;
    fd = open_device(entry.path());
    if (fd.open() && chip_info(fd, info) && chip == info.label) return fd;
  }
  errno = ENOENT;
  return Fd();
}

class UapiStrobe final : public StrobeSource {
 public:
  explicit UapiStrobe(const StrobeConfig& config) : config_(config) { status_.numbered = true; }

  Result<> open() override {
    status_.connected = false;
    line_.reset();
    last_seq_ = 0;   // the kernel counts from 1
    const Fd chip = open_chip(config_.chip);
    if (!chip.open()) return no_chip(config_.chip, errno);
    std::uint32_t offset = static_cast<std::uint32_t>(config_.line);
    if (!config_.line_name.empty() && !find_line(chip, offset)) return gpio_error(config_.chip, "line \"" + config_.line_name + "\"", errno);
    return request(chip, offset);
  }

  Result<bool> wait(Duration timeout) override {
    if (!line_.open()) return gpio_error(config_.chip, "not open", EBADF);
    pollfd p{line_.get(), POLLIN, 0};
    const timespec t{timeout.ns / 1'000'000'000, timeout.ns % 1'000'000'000};
    const int n = ::ppoll(&p, 1, &t, nullptr);
    if (n < 0 && errno != EINTR) return lost_line("waiting for an edge", errno);
    if (n > 0 && (p.revents & POLLIN) == 0) return lost_line("waiting for an edge", ENODEV);
    return n > 0;
  }

  Result<std::size_t> read_many(std::span<StrobeEdge> out) override {
    auto ready = wait({});
    if (!ready) return ready.error();
    if (!*ready || out.empty()) return std::size_t{0};
    std::array<gpio_v2_line_event, kAtOnce> events;
    const ssize_t bytes = ::read(line_.get(), events.data(), std::min(out.size(), kAtOnce) * sizeof events[0]);
    if (bytes < 0) return lost_line("reading an edge", errno);
    const std::size_t n = static_cast<std::size_t>(bytes) / sizeof events[0];
    for (std::size_t i = 0; i < n; ++i) out[i] = take(events[i]);
    status_.edges += n;
    return n;
  }

  [[nodiscard]] StrobeStatus status() const override { return status_; }

 private:
  bool find_line(const Fd& chip, std::uint32_t& offset) const {
    gpiochip_info info;
    if (!chip_info(chip, info)) return false;
    for (std::uint32_t i = 0; i < info.lines; ++i) {
      gpio_v2_line_info line{};
      line.offset = i;
      if (::ioctl(chip.get(), GPIO_V2_GET_LINEINFO_IOCTL, &line) != 0) return false;
      if (config_.line_name == line.name) { offset = i; return true; }
    }
    errno = ENOENT;
    return false;
  }

  Result<> request(const Fd& chip, std::uint32_t offset) {
    gpio_v2_line_request r{};
    r.offsets[0] = offset;
    r.num_lines = 1;
    r.event_buffer_size = kBuffer;
    r.config.flags = GPIO_V2_LINE_FLAG_INPUT | (config_.rising ? GPIO_V2_LINE_FLAG_EDGE_RISING : GPIO_V2_LINE_FLAG_EDGE_FALLING);
    std::copy_n(kGpioConsumer, sizeof kGpioConsumer, r.consumer);
    if (::ioctl(chip.get(), GPIO_V2_GET_LINE_IOCTL, &r) != 0) {
      if (errno == ENOTTY) return make_error(ErrorCode::kUnsupported, config_.chip, "this kernel has no GPIO interface v2 (5.10 or newer)");
      return gpio_error(config_.chip, "line " + std::to_string(offset), errno);
    }
    line_ = Fd(r.fd);
    status_.connected = true;
    return Ok{};
  }

  StrobeEdge take(const gpio_v2_line_event& e) {
    const auto seq = static_cast<std::int64_t>(e.line_seqno);
    if (seq > last_seq_ + 1) status_.lost += static_cast<std::uint64_t>(seq - last_seq_ - 1);
    last_seq_ = seq;
    return {Time{static_cast<std::int64_t>(e.timestamp_ns)}, seq, e.id == GPIO_V2_LINE_EVENT_RISING_EDGE};
  }

  Error lost_line(const char* what, int number) {
    status_.connected = false;
    return gpio_error(config_.chip, what, number);
  }

  StrobeConfig config_;
  StrobeStatus status_;
  Fd line_;
  std::int64_t last_seq_{0};
};

}  // namespace

std::unique_ptr<StrobeSource> make_uapi_strobe(const StrobeConfig& config) { return std::make_unique<UapiStrobe>(config); }

}  // namespace cyclops
