#include "hil/gpio_sim.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>

#include "hil/gige_device.hpp"

namespace cyclops::hil {

Result<std::unique_ptr<GpioSimLine>> GpioSimLine::open(const std::string& chip_folder, int line) {
  const std::string path = chip_folder + "/sim_gpio" + std::to_string(line) + "/pull";
  Fd file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (!file.open())
    return make_error(errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo, path, std::string(std::strerror(errno)) + "; expected a line of a gpio-sim chip");
  return std::unique_ptr<GpioSimLine>(new GpioSimLine(std::move(file)));
}

GpioSimLine::~GpioSimLine() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  down_.join();
}

bool GpioSimLine::put(const char* pull) const {
  const auto size = static_cast<ssize_t>(std::strlen(pull));
  return ::pwrite(file_.get(), pull, static_cast<std::size_t>(size), 0) == size;
}

bool GpioSimLine::pulse() {
  std::unique_lock lock(mutex_);
  if (down_at_ns_ != 0) put("pull-down");   // the one before is still up: an edge needs a line that is down
  const std::int64_t before = monotonic_ns();
  const bool taken = put("pull-up");
  const std::int64_t after = monotonic_ns();
  longest_ = std::max(longest_, Duration{after - before});
  if (taken) ++pulses_;
  down_at_ns_ = after + kWidth.ns;
  lock.unlock();
  changed_.notify_one();
  return taken;
}

void GpioSimLine::run() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    if (down_at_ns_ == 0) {
      changed_.wait(lock);
    } else if (const std::int64_t left = down_at_ns_ - monotonic_ns(); left > 0) {
      changed_.wait_for(lock, std::chrono::nanoseconds(left));
    } else {
      put("pull-down");
      down_at_ns_ = 0;
    }
  }
  put("pull-down");
}

}  // namespace cyclops::hil
