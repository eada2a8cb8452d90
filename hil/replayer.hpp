#pragma once
/// Plays a flight through the real paths: GVSP packets from a GigE Vision device, strobe edges, LCM.
///
/// Time     an event of the flight is due at start + (its arrival - first arrival) / speed on CLOCK_MONOTONIC. Nothing is
///          skipped: what leaves later than `late_after` is counted and the largest lateness kept. The stamps inside the
///          messages stay those of the flight; after a seek or a loop all of them move on together, so that no clock goes back.
/// Speed    0.1 to 20; 0 is as fast as the service answers: at most `most_ahead` frames are sent that it has not measured. `answered`
///          keeps to that at any other speed too, which then is the most, not a promise.
/// GPIO     with `gpio_sim` the service reads its GPIO line as in the aircraft and lives on this host's clock, so only speed 1
///          will do; the instants of time marks are moved to that clock, and a pause is a step of GPS time.
/// Camera   frames count from 1 at each start of acquisition, as a camera's do; gaps in the flight's numbers stay gaps. Those of
///          a recorded sortie keep their numbers; frames that were not recorded whole are not sent: they are gaps too.
/// Faults   of a script strike where they would in flight: in the camera, on the line, on the link, in this machine.
/// Threads  run() is one thread, a second one inside sends frames; control methods from any thread.
#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "base/time.hpp"

namespace cyclops::hil {

struct ReplayOptions {
  std::string flight;
  double speed{1};
  bool loop{false};
  bool paused{false};                      ///< wait for play or step
  double start_s{0};                       ///< begin so far into the flight
  std::string lcm_url;
  std::string address;                     ///< empty: that of the rig
  Duration wait_for_client = Duration::from_seconds(30);
  Duration late_after = Duration::from_ms(5);
  std::string gpio_sim;                    ///< folder of a gpio-sim chip: edges are pulses there, on this host's clock, and marks follow
  int gpio_strobe_line{17};
  int gpio_pps_line{-1};                   ///< pulsed at each time mark; -1: none
  int most_ahead{6};
  bool answered{false};                    ///< never further ahead than that at any speed: nothing is lost in a queue, and late counts instead
  std::int64_t most_frames{0};             ///< stop after so many; 0: all
  double most_s{0};                        ///< stop after so many seconds of flight played; 0: all
  std::string faults;                      ///< script (hil/fault_script.hpp); empty: nothing goes wrong
  std::string sent_path;                   ///< CSV of what was sent (hil/sent_log.hpp); empty: none
};

struct ReplayProgress {
  double flight_s{0};                      ///< into the flight
  double length_s{0};
  std::int64_t frames{0};
  double realtime_factor{0};
  std::int64_t late{0};
  bool paused{false};
};

class Replayer {
 public:
  static Result<std::unique_ptr<Replayer>> open(const ReplayOptions& options);
  ~Replayer();
  /// Until the end of the flight, quit() or an error. `progress` is called about twice a second.
  Result<> run(const std::function<void(const ReplayProgress&)>& progress);

  void pause();
  void play();
  void step(int frames);                   ///< so many frames, then pause
  void set_speed(double speed);
  void seek(double flight_s);
  void quit();
  [[nodiscard]] nlohmann::json summary() const;

 private:
  struct State;
  explicit Replayer(std::unique_ptr<State> state);
  std::unique_ptr<State> s_;
};

}  // namespace cyclops::hil
