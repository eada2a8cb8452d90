#pragma once
/// A GigE Vision camera made of software: GVCP and GVSP on one IPv4 address, fed with frames by its owner.
///
/// It is configured completely before its port is bound, so that no client sees it half ready. It sends only to loopback,
/// link-local and private addresses, and only where a client in control told it to.
/// Time     all times are CLOCK_MONOTONIC ns, except FrameToSend::timestamp_ns, which is the camera's own clock.
/// Threads  one control thread inside. send() by one thread at a time; everything else by any thread. The callbacks run on
///          the control thread and must not call the device, streaming() excepted.
/// Memory   no heap in send() after the resend ring holds a frame of that size in each slot.
/// Errors   start() and reappear(): kIo when the address or port cannot be bound, kInvalid for a config out of range.
#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "base/result.hpp"
#include "hil/gige_config.hpp"
#include "hil/gige_faults.hpp"
#include "hil/gige_registers.hpp"
#include "hil/gvsp.hpp"

namespace cyclops::hil {

struct FrameToSend {
  std::uint64_t block_id{0};     ///< from 1; must not go back while a stream is open
  std::int64_t timestamp_ns{0};  ///< camera clock, start of exposure; becomes ticks in the leader
  ImageView image;               ///< any size: what differs from the registers is the client's problem to notice
};

struct SendReport {
  bool sent{false};  ///< false: nobody was streaming, or the stream ended on the way
  Duration late{};   ///< last batch against its deadline; <= 0 never, 0 is on time
};

struct GigeStats {
  std::uint64_t frames_sent{0}, frames_refused{0}, packets{0}, bytes{0}, send_errors{0};
  std::uint64_t commands{0}, malformed{0}, refused_commands{0}, test_packets{0};
  std::uint64_t resend_requests{0}, resent_packets{0}, resend_unknown{0}, resend_limited{0};
  std::uint64_t reanchored{0};   ///< batches that moved the schedule
  std::uint64_t control_lost{0};  ///< controllers that fell silent
  Duration max_late{};
};

/// What the client has set.
struct GigeSettings {
  int width{0};
  int height{0};
  PixelFormat format{PixelFormat::kMono8};
  double frame_rate_hz{0};
  double exposure_us{0};
  int packet_bytes{0};
};

enum class Outage {
  kCable,  ///< nothing comes through, the camera keeps its state
  kPower,  ///< the camera restarts with its configured values and without a controller
};

class GigeDevice {
 public:
  explicit GigeDevice(const GigeConfig& config);
  ~GigeDevice();
  GigeDevice(const GigeDevice&) = delete;
  GigeDevice& operator=(const GigeDevice&) = delete;

  Result<> start();
  void stop();
  /// Called with true at AcquisitionStart, false at its end; set before start().
  void on_acquisition(std::function<void(bool)> callback) { on_acquisition_ = std::move(callback); }
  /// Device clock in ns for the timestamp latch; CLOCK_MONOTONIC when not set. Set before start().
  void set_clock(std::function<std::int64_t()> clock) { clock_ = std::move(clock); }

  [[nodiscard]] bool streaming() const { return streaming_.load(); }
  [[nodiscard]] bool wait_streaming(Duration timeout) const;
  /// Sends one frame, its first batch at `deadline_ns` (past or 0: now), and returns when the last one left.
  SendReport send(const FrameToSend& frame, std::int64_t deadline_ns);

  void set_fault(PacketFault fault);  ///< an empty one ends the faults
  void vanish(Outage outage);         ///< closes the sockets; returns when they are closed
  Result<> reappear();
  /// As if somebody had turned the camera's own knobs: no client is told. What is not given stays.
  void change_settings(std::optional<double> exposure_us, std::optional<double> frame_rate_hz);
  [[nodiscard]] GigeStats stats() const;
  [[nodiscard]] GigeSettings settings() const;

 private:
  struct Stream {
    GvspLayout layout;
    std::uint32_t address{0};
    std::uint16_t port{0};
  };
  Result<> check_config() const;
  Result<> open_sockets();
  void close_sockets();
  void control_loop();
  void receive_one();
  void after(const GvcpEffects& effects);
  void announce();
  void fire_test_packet();
  void resend(const ResendRequest& request);
  void refuse_resend(const ResendRequest& request, std::uint32_t packet_id);
  [[nodiscard]] Stream stream_now() const;
  void plan(const KeptFrame& frame, std::uint32_t first, std::uint32_t last, bool again, std::vector<std::uint32_t>& order);
  void send_batch(const Stream& to, const KeptFrame& frame, std::span<const std::uint32_t> ids, std::uint16_t status);
  void send_packets(const Stream& to, std::span<const GvspPacket> packets);
  KeptFrame* keep(const FrameToSend& frame, const Stream& to);
  bool transmit(const KeptFrame& frame, const Stream& to, Pacer& pacer, Duration& late);
  [[nodiscard]] std::uint64_t tick_of(std::int64_t ns) const;

  const GigeConfig config_;
  std::uint32_t address_{0};
  std::function<void(bool)> on_acquisition_;
  std::function<std::int64_t()> clock_;

  mutable std::mutex mutex_;  // everything below, except what one thread owns
  mutable std::condition_variable changed_;
  GigeRegisters registers_;
  ResendRing ring_;
  RateLimit resend_limit_;
  PacketFault fault_;
  GigeStats stats_;
  int control_fd_{-1};
  int stream_fd_{-1};
  bool gone_{false};
  std::atomic<bool> streaming_{false};
  std::atomic<bool> stopping_{false};
  bool announced_{false};                  // control thread's
  std::vector<std::uint32_t> send_order_;    // sender's
  std::vector<std::uint32_t> resend_order_;  // control thread's
  std::thread thread_;
};

[[nodiscard]] std::int64_t monotonic_ns();
void sleep_until_ns(std::int64_t deadline_ns);

}  // namespace cyclops::hil
