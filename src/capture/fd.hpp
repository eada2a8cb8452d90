#pragma once
/// Owns a file descriptor.
#include <utility>

#include <unistd.h>

namespace cyclops {

class Fd {
 public:
  explicit Fd(int fd = -1) : fd_(fd) {}
  ~Fd() { reset(); }
  Fd(Fd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Fd& operator=(Fd&& other) noexcept { std::swap(fd_, other.fd_); return *this; }
  void reset() { if (fd_ >= 0) ::close(std::exchange(fd_, -1)); }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool open() const { return fd_ >= 0; }

 private:
  int fd_;
};

}  // namespace cyclops
