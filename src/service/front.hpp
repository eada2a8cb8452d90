#pragma once
/// All that happens to a frame before its pixels are looked at: time by strobe edge, then navigation at that time.
///
/// Pure: the outcome depends on the sequence of calls alone, so live, bench and offline agree.
/// Threads  one at a time. Memory: on construction only.
#include <cstdint>
#include <optional>

#include "base/static_vector.hpp"
#include "msg/strobe.hpp"
#include "nav/frame_aligner.hpp"
#include "timesync/frame_stamper.hpp"
#include "timesync/gps_clock.hpp"
#include "wire/tspi_guard.hpp"

namespace cyclops {

struct FrontCounters {
  std::uint64_t tspi_before_clock{0};   ///< waited for the first time mark and were then used
  std::uint64_t tspi_without_clock{0};  ///< dropped: no relation of GPS to service time, and no room to wait
  std::uint64_t untimed_frames{0};      ///< frames whose time is unknown
};

class Front {
 public:
  Front(const FrameStamperConfig& stamper, const GpsClockConfig& gps, const NavConfig& nav, const NavRig& rig);

  void restart(Time start);                       ///< acquisition begins anew
  void push(const StrobeEdge& edge);
  bool push(const TimeMark& mark);                ///< true: the mapping of GPS time changed
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
  [[nodiscard]] const GpsClock& gps() const { return gps_; }
  [[nodiscard]] const TspiGuardCounters& guard(Aircraft a) const { return guard_[static_cast<std::size_t>(a)].counters(); }
  [[nodiscard]] const FrontCounters& counters() const { return counters_; }

 private:
  void use(const TspiReport& report);
  void use_early();
  void move_stamped();

  FrameStamper stamper_;
  GpsClock gps_;
  TspiGuard guard_[2]{TspiGuard(Aircraft::kReceiver), TspiGuard(Aircraft::kTanker)};
  FrameAligner aligner_;
  StaticVector<TspiReport, 256> early_{};
  std::uint64_t in_{0};
  std::uint64_t out_{0};
  FrontCounters counters_{};
};

}  // namespace cyclops
