#pragma once
/// What the service knows about itself at one moment, copied whole from thread to thread.
#include "base/histogram.hpp"
#include "capture/camera_counters.hpp"
#include "capture/strobe_source.hpp"
#include "msg/chain.hpp"
#include "service/chain.hpp"
#include "service/front.hpp"
#include "service/recorder.hpp"
#include "wire/tspi_guard.hpp"

namespace cyclops {

/// Of the thread that runs the chain.
struct ChainCounts {
  std::uint64_t frames{0};             ///< through the chain
  std::uint64_t nav_updates{0};
  std::uint64_t measurements{0};       ///< accepted
  std::uint64_t consensus{0};          ///< frames in which the features agreed
  std::uint64_t front_refused{0};      ///< frames the front had no room for
  std::uint64_t room_flushed{0};       ///< times all places were taken by frames that waited: they went on with what there was
  std::uint64_t arrival_unknown{0};    ///< frames that waited in vain for their arrival on the strobe's clock
  StampCounters stamp{};
  AlignerCounters aligner{};
  TspiCounters tspi[2]{};
  GpsClockCounters gps{};
  PpsCounters pps{};
  ClockState clocks{};
  FrontCounters front{};
  TrackCounters track{};
  AssociateCounters associate{};
  Time newest_tspi[2]{};
  Time tspi_arrival[2]{};              ///< of the newest that was believed, service clock of this host
  bool has_tspi[2]{};
};

enum class Link : std::uint8_t { kReceiver, kTanker, kTimeMark, kMark };
inline constexpr std::size_t kLinks = 4;
/// As counters begin: "tspi.receiver".
[[nodiscard]] const char* to_string(Link link);

/// Of the thread that listens to LCM; one for each Link.
struct LinkCounts {
  std::uint64_t received{0};           ///< all that came
  std::uint64_t refused{0};            ///< did not decode or out of range
  std::uint64_t flooded{0};            ///< beyond the rate of the channel
  std::uint64_t not_authentic{0};
  std::uint64_t replayed{0};
  std::uint64_t guarded{0};            ///< refused by the guard: frozen, too fast
};

/// Of all threads at one moment.
struct Counts {
  ChainCounts chain{};
  CameraCounters camera{};
  StrobeStatus strobe{};
  StrobeStatus pps{};
  LinkCounts link[kLinks]{};
  RecordCounts record{};
};

struct FrameFacts {                    ///< of the newest frame
  Time t_mid{};
  Duration t_mid_sigma{};
  TimeSource time_source{TimeSource::kUnknown};
  int visible{0}, matched{0}, live{0}, coasting{0};
  double range_m{-1};
  double closure_mps{0};
  double residual_rms_px{0};
  double nis_mean{0};
  double integrity{0};
  bool nav_suspect{false};
};

}  // namespace cyclops
