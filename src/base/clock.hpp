#pragma once
/// The clocks of this host, ns. Not for the pure stages: test/layers.sh keeps them out.
#include <time.h>

#include <cstdint>

namespace cyclops {

[[nodiscard]] inline std::int64_t read_clock_ns(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}
/// CLOCK_MONOTONIC: the service clock of a live run.
[[nodiscard]] inline std::int64_t steady_now_ns() { return read_clock_ns(CLOCK_MONOTONIC); }
/// UTC since 1970, as far as this host knows it.
[[nodiscard]] inline std::int64_t utc_now_ns() { return read_clock_ns(CLOCK_REALTIME); }

}  // namespace cyclops
