// Strobe edges from a GPIO line through libgpiod 1.6 (kernel interface v1) or 2.x (v2); CYCLOPS_GPIOD is its major version.
//
//                     1.6                                    2.x
//   edge numbers      none: line_seq is -1                   line_seq, so that every loss shows
//   kernel buffer     16 edges, the oldest are kept          kBuffer edges, the newest are kept
//   full buffer       silent; guessed from a full read       a gap in line_seq
//   time              CLOCK_MONOTONIC (kernel 5.7 or newer)  CLOCK_MONOTONIC, asked for
#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <string>

#include <gpiod.h>

#include "capture/gpio_error.hpp"
#include "capture/strobe_source.hpp"

namespace cyclops {
namespace {

#if CYCLOPS_GPIOD >= 2

constexpr std::size_t kBuffer = 1024;   // the kernel's limit for one line
constexpr std::size_t kAtOnce = 64;

template <auto Free>
struct Deleter {
  template <class T>
  void operator()(T* p) const { Free(p); }
};
using Chip = std::unique_ptr<gpiod_chip, Deleter<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, Deleter<gpiod_chip_info_free>>;
using LineSettings = std::unique_ptr<gpiod_line_settings, Deleter<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, Deleter<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, Deleter<gpiod_request_config_free>>;
using Request = std::unique_ptr<gpiod_line_request, Deleter<gpiod_line_request_release>>;
using Events = std::unique_ptr<gpiod_edge_event_buffer, Deleter<gpiod_edge_event_buffer_free>>;

Chip find_by_label(const std::string& label) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored)) {
    if (!entry.path().filename().string().starts_with("gpiochip")) continue;
    Chip chip(gpiod_chip_open(entry.path().c_str()));
    if (!chip) continue;
    const ChipInfo info(gpiod_chip_get_info(chip.get()));
    if (info && label == gpiod_chip_info_get_label(info.get())) return chip;
  }
  errno = ENOENT;
  return nullptr;
}

Chip open_chip(const std::string& chip) {
  if (chip.starts_with('/')) return Chip(gpiod_chip_open(chip.c_str()));
  const std::string path = "/dev/" + chip;
  if (gpiod_is_gpiochip_device(path.c_str())) return Chip(gpiod_chip_open(path.c_str()));
  return find_by_label(chip);
}

class GpioStrobe final : public StrobeSource {
 public:
  explicit GpioStrobe(const StrobeConfig& config) : config_(config) { status_.numbered = true; }

  Result<> open() override {
    status_.connected = false;
    request_.reset();
    last_seq_ = 0;   // the kernel counts from 1
    const Chip chip = open_chip(config_.chip);
    if (!chip) return no_chip(config_.chip, errno);
    unsigned int offset = static_cast<unsigned int>(config_.line);
    if (!config_.line_name.empty()) {
      const int found = gpiod_chip_get_line_offset_from_name(chip.get(), config_.line_name.c_str());
      if (found < 0) return gpio_error(config_.chip, "line \"" + config_.line_name + "\"", errno);
      offset = static_cast<unsigned int>(found);
    }
    return request(chip.get(), offset);
  }

  Result<bool> wait(Duration timeout) override {
    if (!request_) return gpio_error(config_.chip, "not open", EBADF);
    const int n = gpiod_line_request_wait_edge_events(request_.get(), timeout.ns);
    if (n < 0 && errno != EINTR) return lost_line("waiting for an edge");
    return n > 0;
  }

  Result<std::size_t> read_many(std::span<StrobeEdge> out) override {
    auto ready = wait({});
    if (!ready) return ready.error();
    if (!*ready || out.empty()) return std::size_t{0};
    const int n = gpiod_line_request_read_edge_events(request_.get(), events_.get(), std::min(out.size(), kAtOnce));
    if (n < 0) return lost_line("reading an edge");
    for (int i = 0; i < n; ++i) out[static_cast<std::size_t>(i)] = take(gpiod_edge_event_buffer_get_event(events_.get(), static_cast<unsigned long>(i)));
    status_.edges += static_cast<std::uint64_t>(n);
    return static_cast<std::size_t>(n);
  }

  [[nodiscard]] StrobeStatus status() const override { return status_; }

 private:
  Result<> request(gpiod_chip* chip, unsigned int offset) {
    const LineSettings settings(gpiod_line_settings_new());
    const LineConfig lines(gpiod_line_config_new());
    const RequestConfig request(gpiod_request_config_new());
    if (!events_) events_.reset(gpiod_edge_event_buffer_new(kAtOnce));
    if (!settings || !lines || !request || !events_) return gpio_error(config_.chip, "memory", errno);
    gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_INPUT);
    gpiod_line_settings_set_edge_detection(settings.get(), config_.rising ? GPIOD_LINE_EDGE_RISING : GPIOD_LINE_EDGE_FALLING);
    gpiod_line_settings_set_event_clock(settings.get(), GPIOD_LINE_CLOCK_MONOTONIC);
    if (gpiod_line_config_add_line_settings(lines.get(), &offset, 1, settings.get()) != 0) return gpio_error(config_.chip, place(offset), errno);
    gpiod_request_config_set_consumer(request.get(), kGpioConsumer);
    gpiod_request_config_set_event_buffer_size(request.get(), kBuffer);
    request_.reset(gpiod_chip_request_lines(chip, request.get(), lines.get()));
    if (!request_) return gpio_error(config_.chip, place(offset), errno);
    status_.connected = true;
    return Ok{};
  }

  StrobeEdge take(gpiod_edge_event* e) {
    const auto seq = static_cast<std::int64_t>(gpiod_edge_event_get_line_seqno(e));
    if (seq > last_seq_ + 1) status_.lost += static_cast<std::uint64_t>(seq - last_seq_ - 1);
    last_seq_ = seq;
    return {Time{static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(e))}, seq, gpiod_edge_event_get_event_type(e) == GPIOD_EDGE_EVENT_RISING_EDGE};
  }

  Error lost_line(const char* what) {
    const int number = errno;
    status_.connected = false;
    return gpio_error(config_.chip, what, number);
  }
  static std::string place(unsigned int offset) { return "line " + std::to_string(offset); }

  StrobeConfig config_;
  StrobeStatus status_;
  Request request_;
  Events events_;
  std::int64_t last_seq_{0};
};

#else

constexpr std::size_t kBuffer = 16;   // the kernel's, not to be changed

struct ChipCloser {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }   // releases its lines too
};

class GpioStrobe final : public StrobeSource {
 public:
  explicit GpioStrobe(const StrobeConfig& config) : config_(config) {}

  Result<> open() override {
    status_.connected = false;
    line_ = nullptr;
    chip_.reset();
    chip_.reset(gpiod_chip_open_lookup(config_.chip.c_str()));
    if (!chip_) return no_chip(config_.chip, errno);
    const std::string place = config_.line_name.empty() ? "line " + std::to_string(config_.line) : "line \"" + config_.line_name + "\"";
    gpiod_line* line = config_.line_name.empty() ? gpiod_chip_get_line(chip_.get(), static_cast<unsigned int>(config_.line))
                                                 : gpiod_chip_find_line(chip_.get(), config_.line_name.c_str());
    if (line == nullptr) return gpio_error(config_.chip, place, errno);
    const int failed = config_.rising ? gpiod_line_request_rising_edge_events(line, kGpioConsumer) : gpiod_line_request_falling_edge_events(line, kGpioConsumer);
    if (failed != 0) return gpio_error(config_.chip, place, errno);
    line_ = line;
    status_.connected = true;
    return Ok{};
  }

  Result<bool> wait(Duration timeout) override {
    if (line_ == nullptr) return gpio_error(config_.chip, "not open", EBADF);
    const timespec t{timeout.ns / 1'000'000'000, timeout.ns % 1'000'000'000};
    const int n = gpiod_line_event_wait(line_, &t);
    if (n < 0 && errno != EINTR) return lost_line("waiting for an edge");
    return n > 0;
  }

  Result<std::size_t> read_many(std::span<StrobeEdge> out) override {
    auto ready = wait({});
    if (!ready) return ready.error();
    if (!*ready || out.empty()) return std::size_t{0};
    std::array<gpiod_line_event, kBuffer> events;
    const auto room = static_cast<unsigned int>(std::min(out.size(), kBuffer));
    const int n = gpiod_line_event_read_multiple(line_, events.data(), room);
    if (n < 0) return lost_line("reading an edge");
    if (n == static_cast<int>(kBuffer)) ++status_.overruns;
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i)
      out[i] = {Time{events[i].ts.tv_sec * 1'000'000'000LL + events[i].ts.tv_nsec}, -1, events[i].event_type == GPIOD_LINE_EVENT_RISING_EDGE};
    status_.edges += static_cast<std::uint64_t>(n);
    return static_cast<std::size_t>(n);
  }

  [[nodiscard]] StrobeStatus status() const override { return status_; }

 private:
  Error lost_line(const char* what) {
    const int number = errno;
    status_.connected = false;
    return gpio_error(config_.chip, what, number);
  }

  StrobeConfig config_;
  StrobeStatus status_;
  std::unique_ptr<gpiod_chip, ChipCloser> chip_;
  gpiod_line* line_{nullptr};   // owned by the chip
};

#endif

}  // namespace

std::unique_ptr<StrobeSource> make_gpiod_strobe(const StrobeConfig& config) { return std::make_unique<GpioStrobe>(config); }

}  // namespace cyclops
