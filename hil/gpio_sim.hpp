#pragma once
/// Pulses a line of the kernel's simulated GPIO chip (gpio-sim): to whoever reads that line it is an edge of real hardware,
/// with the kernel's own time stamp.
///
/// Chip     the folder of the simulated chip, /sys/devices/platform/gpio-sim.N/gpiochipM; `tools/gpio_sim.sh` makes one and
///          prints it. A line's level is set through its file sim_gpio<line>/pull.
/// Time     the edge comes when `pulse` is called; the line goes back after kWidth, on a thread inside.
/// Threads  one caller at a time.
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "base/result.hpp"
#include "base/time.hpp"
#include "capture/fd.hpp"

namespace cyclops::hil {

class GpioSimLine {
 public:
  static constexpr Duration kWidth{1'000'000};
  /// kNotFound: no such line. kIo: no permission (the file is root's).
  static Result<std::unique_ptr<GpioSimLine>> open(const std::string& chip_folder, int line);
  ~GpioSimLine();
  GpioSimLine(const GpioSimLine&) = delete;
  GpioSimLine& operator=(const GpioSimLine&) = delete;
  /// One edge up, now. False when the kernel refused (the chip was removed).
  bool pulse();
  [[nodiscard]] std::uint64_t pulses() const { return pulses_; }
  /// Largest time the kernel took to take an edge.
  [[nodiscard]] Duration longest_write() const { return longest_; }

 private:
  explicit GpioSimLine(Fd file) : file_(std::move(file)), down_([this] { run(); }) {}
  bool put(const char* pull) const;
  void run();

  Fd file_;
  std::uint64_t pulses_{0};
  Duration longest_{};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::int64_t down_at_ns_{0};   // 0: the line is down
  bool ending_{false};
  std::thread down_;
};

}  // namespace cyclops::hil
