#pragma once
/// Events of one log between those who have them and the thread that writes: the givers copy, nobody waits for a disk.
///
/// Two halves of fixed size: givers fill one while the writer has the other. An event that finds no room is refused and
/// counted; its number is used up, so that the gap in the log's numbers shows where something is missing.
/// Threads  append() by any number; take() by one. Memory: both halves, on construction.
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "record/event_log.hpp"

namespace cyclops::record {

class EventBuffer {
 public:
  explicit EventBuffer(std::size_t bytes) : filling_(bytes), writing_(bytes) {}

  bool append(std::int64_t time_us, const char* channel, const void* data, std::size_t bytes);
  struct Piece {
    std::span<const std::uint8_t> bytes{};   ///< whole events; valid until the next take()
    std::uint64_t events{0};
  };
  /// All that has come since the last call.
  Piece take();
  [[nodiscard]] std::uint64_t refused() const { const std::lock_guard lock(mutex_); return refused_; }

 private:
  mutable std::mutex mutex_;
  std::vector<std::uint8_t> filling_, writing_;
  std::size_t used_{0};
  std::uint64_t events_{0};
  std::int64_t number_{0};
  std::uint64_t refused_{0};
};

}  // namespace cyclops::record
