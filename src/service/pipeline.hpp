#pragma once
/// The running service. The one place that knows threads and queues.
///
///   thread     wakes on                        does                                    deadline
///   camera     GVSP frame, or 100 ms           frames into the queue, camera events    one period
///   strobe     edge, or 100 ms                 edges (and bench arrivals) into it      16 edges (kernel FIFO)
///   link       LCM message, or 100 ms          decodes TSPI and time marks into it     one TSPI period
///   chain      the queue                       timesync, nav, chain                    one period
///   publish    a finished frame, or 20 ms      LCM messages, thumbnails, alarms, HEALTH  none
///
/// and, when a sortie is recorded, the three of recorder.hpp.
/// camera, strobe and link feed one bounded queue; its order alone decides the results. chain hands whole FrameOutputs to
/// publish and gets them back; nothing is shared in between. Every queue counts what it refuses.
/// Errors  start(): what cannot be had at all (LCM, strobe line). A missing camera is no error: it is waited for.
#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "base/result.hpp"
#include "monitor/limits.hpp"
#include "service/profile.hpp"
#include "service/record_options.hpp"
#include "service/rig.hpp"
#include "wire/signed.hpp"

namespace cyclops {

struct ServiceOptions {
  std::string lcm_url;              ///< empty: LCM_DEFAULT_URL, else LCM's own default with ttl 0
  double thumbnail_hz{1};           ///< 0: none
  int thumbnail_px{256};            ///< longer side
  Limits limits = Limits::built_in();
  std::optional<Key> key{};         ///< TSPI, time marks and event marks must carry a tag made with it
  double idle_flush_s{0.5};         ///< a camera silent for so long: waiting frames go on with what there is
  RecordOptions record{};           ///< nothing is recorded unless a folder is given
  std::string profile_path;         ///< for the record; empty: the built-in profile
};

class Pipeline {
 public:
  Pipeline(Rig rig, Profile profile, ServiceOptions options);
  ~Pipeline();
  Result<> start();
  /// Finishes what is in the queues, then joins every thread. Error: the record did not become a flight.
  Result<> stop();
  /// Figures of the whole run as JSON text; after stop().
  [[nodiscard]] std::string summary() const;
  [[nodiscard]] std::uint64_t frames() const;        ///< through the chain so far
  [[nodiscard]] double idle_s() const;               ///< since the last frame; 0 before the first

  struct State;

 private:
  std::unique_ptr<State> s_;
};

}  // namespace cyclops
