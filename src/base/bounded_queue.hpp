#pragma once
/// A queue between two threads with a fixed number of places. A full queue refuses and counts; it never blocks the giver.
///
/// Threads: any number of givers, one taker. Memory: the ring, on construction. The lock covers one move, nothing else.
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "base/time.hpp"

namespace cyclops {

template <class T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t places) : ring_(places) {}

  /// False when full: the item is untouched and one more refusal is counted.
  [[nodiscard]] bool try_push(T&& item) {
    {
      const std::lock_guard lock(mutex_);
      if (size_ == ring_.size()) {
        ++refused_;
        return false;
      }
      ring_[(head_ + size_) % ring_.size()].emplace(std::move(item));
      ++size_;
      if (size_ > high_water_) high_water_ = size_;
    }
    ready_.notify_one();
    return true;
  }

  /// Nothing when none came in time, or when closed and empty.
  [[nodiscard]] std::optional<T> pop(Duration timeout) {
    std::unique_lock lock(mutex_);
    ready_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return size_ > 0 || closed_; });
    return take();
  }
  [[nodiscard]] std::optional<T> try_pop() {
    const std::lock_guard lock(mutex_);
    return take();
  }
  void close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    ready_.notify_all();
  }

  [[nodiscard]] std::uint64_t refused() const { const std::lock_guard lock(mutex_); return refused_; }
  [[nodiscard]] std::size_t high_water() const { const std::lock_guard lock(mutex_); return high_water_; }
  [[nodiscard]] std::size_t size() const { const std::lock_guard lock(mutex_); return size_; }
  [[nodiscard]] bool closed() const { const std::lock_guard lock(mutex_); return closed_; }
  /// Closed and empty: nothing more will come. What pop gives back cannot tell that from silence.
  [[nodiscard]] bool finished() const { const std::lock_guard lock(mutex_); return closed_ && size_ == 0; }
  [[nodiscard]] std::size_t places() const { return ring_.size(); }

 private:
  std::optional<T> take() {
    if (size_ == 0) return std::nullopt;
    std::optional<T> out(std::move(*ring_[head_]));
    ring_[head_].reset();
    head_ = (head_ + 1) % ring_.size();
    --size_;
    return out;
  }
  mutable std::mutex mutex_;
  std::condition_variable ready_;
  std::vector<std::optional<T>> ring_;
  std::size_t head_{0};
  std::size_t size_{0};
  std::size_t high_water_{0};
  std::uint64_t refused_{0};
  bool closed_{false};
};

}  // namespace cyclops
