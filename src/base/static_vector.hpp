#pragma once
/// A vector whose room is part of its type: no heap, and a full one says so instead of growing.
#include <algorithm>
#include <array>
#include <cstddef>

#include "base/result.hpp"

namespace cyclops {

template <class T, std::size_t N>
class StaticVector {
 public:
  using value_type = T;
  StaticVector() = default;
  StaticVector(std::initializer_list<T> items) { for (const T& item : items) push_back(item); }
  /// False, and nothing added, when full: the caller counts what it lost.
  bool try_push_back(const T& item) {
    if (size_ == N) return false;
    items_[size_++] = item;
    return true;
  }
  void push_back(const T& item) { CYCLOPS_ASSERT(try_push_back(item)); }
  void resize(std::size_t n) {
    CYCLOPS_ASSERT(n <= N);
    for (std::size_t i = size_; i < n; ++i) items_[i] = T{};
    size_ = n;
  }
  void pop_back() { CYCLOPS_ASSERT(size_ > 0); --size_; }
  void clear() { size_ = 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] bool full() const { return size_ == N; }
  [[nodiscard]] static constexpr std::size_t capacity() { return N; }
  T& operator[](std::size_t i) { CYCLOPS_ASSERT(i < size_); return items_[i]; }
  const T& operator[](std::size_t i) const { CYCLOPS_ASSERT(i < size_); return items_[i]; }
  T* begin() { return items_.data(); }
  T* end() { return items_.data() + size_; }
  const T* begin() const { return items_.data(); }
  const T* end() const { return items_.data() + size_; }
  T& front() { return (*this)[0]; }
  const T& front() const { return (*this)[0]; }
  T& back() { return (*this)[size_ - 1]; }
  const T& back() const { return (*this)[size_ - 1]; }
  friend bool operator==(const StaticVector& a, const StaticVector& b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

 private:
  std::array<T, N> items_{};
  std::size_t size_{0};
};

}  // namespace cyclops
