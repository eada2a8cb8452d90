#pragma once
/// Reads LCM's big-endian fields without ever leaving the bytes, and remembers the first thing wrong with them.
///
/// lcm-gen's own decoders believe the lengths of strings and arrays: a negative one throws, a huge one allocates first and
/// looks later. Messages with such fields are therefore read with this. After the first problem every read gives zero.
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>

#include "base/result.hpp"

namespace cyclops::wire {

class Reader {
 public:
  /// `type` and `fingerprint`: what the bytes must begin with.
  Reader(const char* channel, const char* type, std::int64_t fingerprint, const void* data, std::size_t size);

  [[nodiscard]] bool ok() const { return !error_.has_value(); }
  [[nodiscard]] std::size_t left() const { return size_ - at_; }
  [[nodiscard]] const Error& error() const { return *error_; }
  void fail(ErrorCode code, const char* field, const std::string& what);

  template <class T>
  T get(const char* field) {
    std::conditional_t<sizeof(T) == 8, std::uint64_t, std::conditional_t<sizeof(T) == 4, std::uint32_t, std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>> bits = 0;
    const auto raw = take(field, sizeof(T));
    for (const std::uint8_t byte : raw) bits = static_cast<decltype(bits)>((static_cast<std::uint64_t>(bits) << 8) | byte);
    return std::bit_cast<T>(bits);
  }
  /// The bytes themselves; empty after a problem.
  std::span<const std::uint8_t> take(const char* field, std::size_t n);
  /// A length that must lie in [0, most]. Zero after a problem.
  std::size_t length(const char* field, std::size_t most);
  /// LCM string: length with the closing zero, text, zero; no zero inside.
  std::string_view text(const char* field, std::size_t most);
  /// The message must be at its end.
  void finish();

  // Reads a field that must lie in [low, high]; NaN does not.
  double real(const char* field, double low, double high) { return within(field, get<double>(field), low, high); }
  std::int64_t whole(const char* field, std::int64_t low, std::int64_t high) { return within(field, get<std::int64_t>(field), low, high); }
  template <class Wire>
  std::int64_t small(const char* field, std::int64_t low, std::int64_t high) { return within(field, static_cast<std::int64_t>(get<Wire>(field)), low, high); }
  bool flag(const char* field) { return small<std::int8_t>(field, 0, 1) != 0; }
  /// Three numbers whose norm must not exceed `most`.
  template <class V>
  V vector(const char* field, double most) {
    V v;
    for (int i = 0; i < 3; ++i) v[i] = get<double>(field);
    within(field, v.norm(), 0.0, most, "norm ");
    return v;
  }
  /// Three numbers, each in [0, most].
  template <class V>
  V sigmas(const char* field, double most) {
    V v;
    for (int i = 0; i < 3; ++i) v[i] = real(field, 0, most);
    return v;
  }
  /// w x y z, norm within `tolerance` of 1.
  template <class Q>
  Q quaternion(const char* field, double tolerance) {
    Q q;
    q.w() = get<double>(field);
    q.x() = get<double>(field);
    q.y() = get<double>(field);
    q.z() = get<double>(field);
    within(field, q.norm(), 1 - tolerance, 1 + tolerance, "norm ");
    return ok() ? Q(q.normalized()) : Q(1, 0, 0, 0);
  }

 private:
  double within(const char* field, double v, double low, double high, const char* kind = "");
  std::int64_t within(const char* field, std::int64_t v, std::int64_t low, std::int64_t high);

  const char* channel_;
  const char* type_;
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_{0};
  std::optional<Error> error_{};
};

}  // namespace cyclops::wire
