#pragma once
/// GPS time to service time and back, by an integer offset that stays the same until marks contradict it.
///
/// The first mark locks the offset; each later one is compared with it. Contradictions in a row that agree with each other
/// lock anew, which is counted and to be reported. Before the first mark, or without marks, the least of
/// arrival - GPS over the first TSPI reports serves; it is late by the transport of the fastest one and its sigma says 20 ms.
/// A clock model that follows drift (PPS at 1 Hz, holdover) can replace this class; its callers know only the mapping.
/// Threads  one at a time. No clock. Memory: in place. Deterministic: only the order of the inputs matters.
#include <cstdint>

#include "base/config.hpp"
#include "base/result.hpp"
#include "base/time.hpp"
#include "msg/strobe.hpp"

namespace cyclops {

enum class GpsSource : std::uint8_t { kNone, kArrival, kTimeMark };

struct GpsClockConfig {
  bool use_arrival{false};               ///< rig: gps_from = "arrival"; marks win when there are any
  double gate_sigma{5};                  ///< contradiction beyond this many sigma of both marks ...
  Duration gate_floor{200'000};          ///< ... and beyond this: two free clocks drift apart by 20 us in a second
  int contradictions{3};                 ///< so many in a row, agreeing with each other, lock anew
  Duration arrival_sigma{20'000'000};
  int arrival_reports{100};              ///< so many reports settle the arrival offset

  /// Key of the rig's [time]: gps_from.
  static Result<GpsClockConfig> read(ConfigTable& time);
};

struct GpsClockCounters {
  std::uint64_t marks{0};
  std::uint64_t contradictions{0};       ///< marks outside the gate
  std::uint64_t relocks{0};              ///< offset changed by marks
  std::uint64_t refused{0};              ///< marks with a sigma that is not positive
  std::uint64_t arrivals{0};             ///< arrivals used
  std::uint64_t arrival_relocks{0};      ///< offset by arrival changed after it had settled
};

class GpsClock {
 public:
  explicit GpsClock(const GpsClockConfig& config) : config_(config) {}
  /// True when this mark changed the mapping (first lock or new lock): worth an event.
  bool on_mark(const TimeMark& mark);
  /// `sent` is the time of validity in the report; only used while no mark has come and the config allows it.
  bool on_arrival(Time arrival, GpsTime sent);

  [[nodiscard]] GpsSource source() const { return source_; }
  [[nodiscard]] bool valid() const { return source_ != GpsSource::kNone; }
  /// Both need valid(). Exact inverses of each other.
  [[nodiscard]] Time to_service(GpsTime t) const;
  [[nodiscard]] GpsTime to_gps(Time t) const;
  /// 1 sigma of the mapping: of the mark that locked, or how far the last accepted mark was off if that is more.
  [[nodiscard]] Duration sigma() const { return sigma_; }
  /// Service minus GPS.
  [[nodiscard]] Duration offset() const { return offset_; }
  [[nodiscard]] const GpsClockCounters& counters() const { return counters_; }

 private:
  void lock(Duration offset, Duration sigma, GpsSource source);
  [[nodiscard]] bool agree(Duration a, Duration sigma_a, Duration b, Duration sigma_b) const;

  GpsClockConfig config_;
  GpsClockCounters counters_;
  GpsSource source_{GpsSource::kNone};
  Duration offset_{};
  Duration sigma_{};
  Duration lock_sigma_{};
  Duration rival_{};                     // offset of the first contradiction in a row
  Duration rival_sigma_{};
  int rivals_{0};
  int reports_{0};                       // arrivals since the offset by arrival was begun
  int late_reports_{0};                  // arrivals in a row that are far too late for it
};

}  // namespace cyclops
