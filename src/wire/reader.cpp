#include "wire/reader.hpp"

#include <cinttypes>
#include <cstdio>
#include <string>

namespace cyclops::wire {
namespace {

template <class... Args>
std::string printed(const char* format, Args... args) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

}  // namespace

Reader::Reader(const char* channel, const char* type, std::int64_t fingerprint, const void* data, std::size_t size)
    : channel_(channel), type_(type), data_(static_cast<const std::uint8_t*>(data)), size_(size) {
  const auto found = get<std::int64_t>("fingerprint");
  if (ok() && found != fingerprint)
    fail(ErrorCode::kCorrupt, "fingerprint",
         printed("is %016" PRIx64 ", expected %016" PRIx64 " of %s", static_cast<std::uint64_t>(found), static_cast<std::uint64_t>(fingerprint), type));
}

void Reader::fail(ErrorCode code, const char* field, const std::string& what) {
  if (!error_) error_ = make_error(code, channel_, std::string(field) + " " + what);
}

std::span<const std::uint8_t> Reader::take(const char* field, std::size_t n) {
  if (!ok()) return {};
  if (n > left()) {
    fail(ErrorCode::kTruncated, field, printed("is missing: %zu bytes of %s, expected at least %zu", size_, type_, at_ + n));
    return {};
  }
  const std::span<const std::uint8_t> bytes(data_ + at_, n);
  at_ += n;
  return bytes;
}

std::size_t Reader::length(const char* field, std::size_t most) {
  const auto n = get<std::int32_t>(field);
  if (n >= 0 && static_cast<std::size_t>(n) <= most) return static_cast<std::size_t>(n);
  fail(ErrorCode::kCorrupt, field, printed("is %d, expected 0 to %zu", n, most));
  return 0;
}

std::string_view Reader::text(const char* field, std::size_t most) {
  const auto n = get<std::int32_t>(field);
  if (ok() && (n < 1 || static_cast<std::size_t>(n) > most + 1))
    fail(ErrorCode::kCorrupt, field, printed("has length %d with its closing zero, expected 1 to %zu", n, most + 1));
  if (!ok()) return {};
  const auto bytes = take(field, static_cast<std::size_t>(n));
  if (!ok()) return {};
  const auto* chars = reinterpret_cast<const char*>(bytes.data());
  if (const void* zero = std::memchr(chars, 0, bytes.size()); zero != chars + bytes.size() - 1) {
    fail(ErrorCode::kCorrupt, field, "does not end with its only zero");
    return {};
  }
  return {chars, bytes.size() - 1};
}

void Reader::finish() {
  if (ok() && left() != 0) fail(ErrorCode::kCorrupt, type_, printed("has %zu bytes, expected %zu", size_, at_));
}

double Reader::within(const char* field, double v, double low, double high, const char* kind) {
  if (!(v >= low && v <= high)) fail(ErrorCode::kInvalid, field, printed("%sis %.9g, expected %.9g to %.9g", kind, v, low, high));
  return v;
}

std::int64_t Reader::within(const char* field, std::int64_t v, std::int64_t low, std::int64_t high) {
  if (v < low || v > high) fail(ErrorCode::kInvalid, field, printed("is %" PRId64 ", expected %" PRId64 " to %" PRId64, v, low, high));
  return v;
}

}  // namespace cyclops::wire
