#pragma once
/// GPS time to service time and back: offset and drift of the two clocks, from marks (PPS), or for want of them from arrivals.
///
/// GPS time counts on through leap seconds and has no weeks here (base/time.hpp), so neither leap nor rollover occurs in it;
/// a source of marks that gets one of them wrong shows as a step by whole seconds, which is believed only after ten marks.
/// Marks    each is gated, weighed and followed by timesync/clock_filter.hpp. Contradictions in a row that agree with each other
///          lock anew, which is counted and to be reported.
/// Holdover without marks the last line is carried on; `age_at` and a growing `sigma_at` say so.
/// Order    a mark rules the times from `mark_delay` after its own instant on, up to where the next one begins. So a
///          result does not depend on how marks and the stamps to be converted interleave, unless a mark is later than that.
/// Arrival  before the first mark, and only if the config says so, the least of arrival - GPS over the first TSPI
///          reports serves; it is late by the transport of the fastest one and its sigma says 20 ms.
/// Threads  one at a time. No clock. Memory: in place. Deterministic: only the order of the inputs matters.
#include <cstdint>

#include "base/config.hpp"
#include "base/result.hpp"
#include "base/time.hpp"
#include "msg/strobe.hpp"
#include "timesync/clock_filter.hpp"
#include "timesync/ring.hpp"

namespace cyclops {

enum class GpsSource : std::uint8_t { kNone, kArrival, kTimeMark };

struct GpsClockConfig {
  bool use_pps{false};                   ///< rig: gps_from = "pps": marks are made here, from edges of the PPS line
  bool use_arrival{false};               ///< rig: gps_from = "arrival"; marks win when there are any
  double gate_sigma{5};                  ///< contradiction beyond this many sigma of line and mark ...
  Duration gate_floor{200'000};          ///< ... and beyond this
  int contradictions{3};                 ///< so many in a row, agreeing with each other, lock anew
  int whole_seconds{10};                 ///< so many if they are off by whole seconds
  Duration mark_delay{1'000'000'000};
  Duration arrival_sigma{20'000'000};
  int arrival_reports{100};              ///< so many reports settle the arrival offset
  ClockNoise clock{0, 100, 100e-6, 600e-6, 1e-7, 10};   ///< the kernel may steer CLOCK_MONOTONIC by up to 500 ppm

  /// Keys of the rig's [time]: gps_from. clock_wander_ppm is read by FrameStamperConfig and holds for both.
  static Result<GpsClockConfig> read(ConfigTable& time);
};

struct GpsClockCounters {
  std::uint64_t marks{0};
  std::uint64_t contradictions{0};       ///< marks outside the gate, or not later than the one before
  std::uint64_t relocks{0};              ///< offset changed by marks in one step
  std::uint64_t whole_second_steps{0};   ///< of these, by whole seconds: leap second, UTC for GPS time, or week rollover
  std::uint64_t refused{0};              ///< marks with a sigma that is not positive
  std::uint64_t arrivals{0};             ///< arrivals used
  std::uint64_t arrival_relocks{0};      ///< offset by arrival changed after it had settled
};

class GpsClock {
 public:
  explicit GpsClock(const GpsClockConfig& config) : config_(config), line_(config.clock) {}
  /// True when this mark locked, first or anew: worth an event.
  bool on_mark(const TimeMark& mark);
  /// `sent` is the time of validity in the report; only used while no mark has come and the config allows it.
  bool on_arrival(Time arrival, GpsTime sent);

  [[nodiscard]] GpsSource source() const { return source_; }
  [[nodiscard]] bool valid() const { return source_ != GpsSource::kNone; }
  /// Do marks rule this time? From `mark_delay` after the first one on, whatever has come meanwhile.
  [[nodiscard]] bool rules(Time t) const { return source_ == GpsSource::kTimeMark && t >= first_.t + config_.mark_delay; }
  [[nodiscard]] bool rules(GpsTime t) const { return source_ == GpsSource::kTimeMark && t.ns >= first_.t_gps.ns + config_.mark_delay.ns; }
  // All below need valid().
  /// Inverses of each other within a nanosecond, but for times within the drift of a second of where a mark begins to rule.
  [[nodiscard]] Time to_service(GpsTime t) const;
  [[nodiscard]] GpsTime to_gps(Time t) const;
  /// 1 sigma of the mapping at t: of the line, grown since its last mark, and of the mark itself, whose constant part no
  /// averaging takes away.
  [[nodiscard]] Duration sigma_at(Time t) const;
  [[nodiscard]] Duration age_at(Time t) const;          ///< since the newest mark; zero when it is later than t, or by arrival
  [[nodiscard]] Duration offset() const;                ///< service minus GPS at the newest mark
  [[nodiscard]] double drift_ppm() const { return source_ == GpsSource::kTimeMark ? line_.rate() * 1e6 : 0; }   ///< service against GPS
  [[nodiscard]] double drift_sigma_ppm() const { return line_.rate_sigma() * 1e6; }
  [[nodiscard]] const GpsClockCounters& counters() const { return counters_; }

 private:
  struct Ruling { ClockFilter line{ClockNoise{}}; Duration mark_sigma{}; };
  void follow(const TimeMark& mark);
  void lock(const TimeMark& mark);
  [[nodiscard]] bool agrees(const TimeMark& mark) const;
  [[nodiscard]] bool like_rival(Duration offset, Duration sigma) const;
  [[nodiscard]] Duration off_by(const TimeMark& mark) const;
  template <class Begins>
  [[nodiscard]] const Ruling& ruling(Begins begins) const;

  GpsClockConfig config_;
  GpsClockCounters counters_;
  GpsSource source_{GpsSource::kNone};
  TimeMark first_{};
  ClockFilter line_;                     // x GPS time, y service
  Ring<Ruling, 8> history_{};
  Duration rival_{};                     // offset of the first contradiction in a row
  Duration rival_sigma_{};
  int rivals_{0};
  Duration arrival_offset_{};
  int reports_{0};                       // arrivals since the offset by arrival was begun
  int late_reports_{0};                  // arrivals in a row that are far too late for it
};

}  // namespace cyclops
