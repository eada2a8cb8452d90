#pragma once
/// The newest N items of a sequence, each under the index it was given when it came.
///
/// Memory: in place, no heap. A push into a full ring overwrites the oldest item.
#include <array>
#include <cstddef>
#include <cstdint>

#include "base/result.hpp"

namespace cyclops {

template <class T, std::size_t N>
class Ring {
 public:
  void push(const T& item) {
    if (end_ - begin_ == N) ++begin_;
    items_[end_++ % N] = item;
  }
  void pop_front() { CYCLOPS_ASSERT(!empty()); ++begin_; }
  void clear() { begin_ = end_; }
  [[nodiscard]] const T& operator[](std::uint64_t index) const { CYCLOPS_ASSERT(index >= begin_ && index < end_); return items_[index % N]; }
  [[nodiscard]] const T& front() const { return (*this)[begin_]; }
  [[nodiscard]] const T& back() const { return (*this)[end_ - 1]; }
  [[nodiscard]] std::uint64_t begin_index() const { return begin_; }
  [[nodiscard]] std::uint64_t end_index() const { return end_; }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(end_ - begin_); }
  [[nodiscard]] bool empty() const { return begin_ == end_; }

 private:
  std::array<T, N> items_{};
  std::uint64_t begin_{0};
  std::uint64_t end_{0};
};

}  // namespace cyclops
