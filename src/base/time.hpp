#pragma once
/// Points in time and spans between them, 64-bit integer nanoseconds.
///
/// Time      service clock: the clock of the strobe stamps (CLOCK_MONOTONIC of the capturing host; the
///           recorded one when a flight is replayed). Everything inside Cyclops is on this clock.
/// GpsTime   GPS time since the GPS epoch, 1980-01-06 00:00:00, no leap seconds. Only TSPI and PPS carry it.
/// Integer so that differences are exact: moving a whole flight by a constant changes no other bit.
#include <compare>
#include <cstdint>

namespace cyclops {

struct Duration {
  std::int64_t ns{0};
  constexpr auto operator<=>(const Duration&) const = default;
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  static constexpr Duration from_seconds(double s) {
    return {static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5))};
  }
  static constexpr Duration from_ms(double ms) { return from_seconds(ms * 1e-3); }
  friend constexpr Duration operator+(Duration a, Duration b) { return {a.ns + b.ns}; }
  friend constexpr Duration operator-(Duration a, Duration b) { return {a.ns - b.ns}; }
  friend constexpr Duration operator-(Duration a) { return {-a.ns}; }
  friend constexpr Duration operator/(Duration a, std::int64_t n) { return {a.ns / n}; }
  friend constexpr Duration operator*(Duration a, std::int64_t n) { return {a.ns * n}; }
};

struct Time {
  std::int64_t ns{0};
  constexpr auto operator<=>(const Time&) const = default;
  friend constexpr Duration operator-(Time a, Time b) { return {a.ns - b.ns}; }
  friend constexpr Time operator+(Time a, Duration d) { return {a.ns + d.ns}; }
  friend constexpr Time operator-(Time a, Duration d) { return {a.ns - d.ns}; }
};

struct GpsTime {
  std::int64_t ns{0};
  constexpr auto operator<=>(const GpsTime&) const = default;
  friend constexpr Duration operator-(GpsTime a, GpsTime b) { return {a.ns - b.ns}; }
  friend constexpr GpsTime operator+(GpsTime a, Duration d) { return {a.ns + d.ns}; }
};

}  // namespace cyclops
