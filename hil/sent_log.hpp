#pragma once
/// What the bench camera has sent, frame by frame, as CSV: the key between what the service says about a frame and what is true.
///
/// A frame is known to the service by block id and camera tick; both together are never used twice in one run.
/// Threads  one.
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "base/result.hpp"

namespace cyclops::hil {

struct SentFrame {
  std::uint64_t block_id{0};       ///< as the camera numbered it
  std::int64_t tick_ns{0};         ///< as the camera's clock stamped it
  std::int64_t flight_id{0};       ///< camera_frame_id in the flight, so also in its TRUTH
  std::int64_t shift_ns{0};        ///< to be added to the times of the flight
  std::uint32_t acquisition{0};    ///< from 1
  bool sent{false};                ///< false: the camera was away
  std::int64_t host_ns{0};         ///< CLOCK_MONOTONIC when its first packet was due to leave
};

class SentLog {
 public:
  /// Nothing is written for an empty path.
  Result<> open(const std::string& path);
  void add(const SentFrame& frame);
  Result<> finish();

 private:
  struct Close {
    void operator()(std::FILE* f) const { std::fclose(f); }
  };
  std::unique_ptr<std::FILE, Close> file_;
  std::string path_;
};

}  // namespace cyclops::hil
