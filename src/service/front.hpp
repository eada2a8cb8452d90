#pragma once
/// All that happens to a frame before its pixels are looked at: time by strobe edge, then navigation at that time.
///
/// GPS time comes, best first: with gps_from = "pps" from edges of the PPS line, numbered by the other two; from TIME_MARK; from the
/// arrival of TSPI. `gps()` says which one it is and how good.
/// Pure: the outcome depends on the sequence of calls alone, so live, bench and offline agree.
/// Threads  one at a time. Memory: on construction only.
#include <cstdint>
#include <optional>

#include "base/static_vector.hpp"
#include "msg/strobe.hpp"
#include "nav/frame_aligner.hpp"
#include "timesync/frame_stamper.hpp"
#include "timesync/gps_clock.hpp"
#include "timesync/pps_marks.hpp"
#include "wire/tspi_guard.hpp"

namespace cyclops {

struct FrontCounters {
  std::uint64_t tspi_before_clock{0};   ///< waited for the first time mark and were then used
  std::uint64_t tspi_without_clock{0};  ///< dropped: no relation of GPS to service time, and no room to wait
  std::uint64_t untimed_frames{0};      ///< frames whose time is unknown
};

/// The clocks as the newest frame finds them.
struct ClockState {
  Time t{};                             ///< of the newest frame that has a time
  GpsSource gps_source{GpsSource::kNone};
  Duration gps_offset{}, gps_sigma{}, gps_age{};
  double gps_drift_ppm{0}, gps_drift_sigma_ppm{0};
  bool strobe_locked{false};
  double camera_drift_ppm{0}, camera_drift_sigma_ppm{0}, edge_scatter_us{0};
  Duration camera_sigma{}, camera_age{};
};

class Front {
 public:
  Front(const FrameStamperConfig& stamper, const GpsClockConfig& gps, const NavConfig& nav, const NavRig& rig, const PpsConfig& pps = {});

  void restart(Time start);                       ///< acquisition begins anew
  void push(const StrobeEdge& edge);
  bool push(const TimeMark& mark);                ///< true: the mapping of GPS time was locked, first or anew
  bool push(const PpsEdge& edge);                 ///< the same
  /// `arrival`: when the report came, service clock; used only while there is no time mark. The guard judges the rate by the
  /// reports' own times, so that a replay at any speed is judged alike.
  TspiVerdict push(const TspiReport& report, Time arrival);
  /// `token` names the caller's pixels. False: not taken, the caller must pop first.
  [[nodiscard]] bool push(const FrameInfo& frame, std::uint64_t token);
  void flush();                                   ///< nothing more will come for what waits
  [[nodiscard]] bool pop(AlignedFrame& out);

  [[nodiscard]] std::size_t waiting() const;
  [[nodiscard]] std::optional<GpsTime> gps_time(Time t) const;
  [[nodiscard]] const FrameStamper& stamper() const { return stamper_; }
  [[nodiscard]] const FrameAligner& aligner() const { return aligner_; }
  [[nodiscard]] const GpsClock& gps() const { return by_pps_ && !gps_.valid() ? rough_ : gps_; }
  [[nodiscard]] ClockState clocks() const;
  [[nodiscard]] const PpsCounters& pps() const { return pps_.counters(); }
  [[nodiscard]] const TspiGuardCounters& guard(Aircraft a) const { return guard_[static_cast<std::size_t>(a)].counters(); }
  [[nodiscard]] const FrontCounters& counters() const { return counters_; }

 private:
  /// With PPS: the rough clock up to a second after the first edge that made a mark, so that the way edges and frames interleave does
  /// not decide which of the two a frame gets.
  template <class Instant>
  [[nodiscard]] const GpsClock& clock_at(Instant t) const { return by_pps_ && rough_.valid() && !gps_.rules(t) ? rough_ : gps(); }
  void use(const TspiReport& report);
  void use_early();
  void move_stamped();

  FrameStamper stamper_;
  bool by_pps_;
  GpsClock gps_;
  GpsClock rough_;                                // numbers the edges of the PPS line, and serves until there are any
  PpsMarks pps_;
  TspiGuard guard_[2]{TspiGuard(Aircraft::kReceiver), TspiGuard(Aircraft::kTanker)};
  FrameAligner aligner_;
  StaticVector<TspiReport, 256> early_{};
  Time newest_{};
  std::uint64_t in_{0};
  std::uint64_t out_{0};
  FrontCounters counters_{};
};

}  // namespace cyclops
