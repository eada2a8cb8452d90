#pragma once
/// Inside the replayer: what its files share. replayer.cpp opens and reports, replay_play.cpp keeps time, replay_outputs.cpp sends.
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <map>
#include <mutex>
#include <thread>

#include <lcm/lcm.h>

#include "base/bounded_queue.hpp"
#include "hil/fault_camera.hpp"
#include "hil/fault_host.hpp"
#include "hil/fault_inputs.hpp"
#include "hil/gige_device.hpp"
#include "hil/gpio_sim.hpp"
#include "hil/replayer.hpp"
#include "hil/sent_log.hpp"
#include "hil/strobe_server.hpp"
#include "record/flight.hpp"
#include "service/rig.hpp"

namespace cyclops::hil {

struct FrameJob {
  std::int64_t number{0};          ///< in frames.lcm
  std::int64_t due_ns{0};          ///< 0: now
  double light{1};                 ///< exposure over the one of the rig
  SentFrame sent{};
};

struct Control {
  std::mutex mutex;
  std::condition_variable changed;
  bool paused{false};
  bool quit{false};
  int steps{0};                    ///< frames to go before pausing again; 0: no stepping
  double speed{1};
  bool speed_changed{false};
  double seek_s{-1};
};

/// Messages of one channel.
struct ChannelCount {
  std::uint64_t offered{0};        ///< by the flight
  std::uint64_t sent{0};
  std::uint64_t failed{0};         ///< LCM would not take it
};

struct Replayer::State {
  State(const ReplayOptions& o, FlightReader f, FlightReader p, Rig r, FaultScript script);
  ~State();

  ReplayOptions options;
  FlightReader flight;             // messages, read by run()
  FlightReader pixels;             // frames, read by the sender
  Rig rig;
  FaultPlayer faults;
  CameraFaults camera_faults;      // the sender's, but for packet()
  InputFaults input_faults;
  std::unique_ptr<FaultHost> host_faults;
  std::string fault_error;
  std::unique_ptr<GigeDevice> device;
  std::unique_ptr<StrobeServer> strobe;
  std::unique_ptr<GpioSimLine> strobe_line, pps_line;
  lcm_t* lcm{nullptr};
  Control control;

  BoundedQueue<FrameJob> jobs{4};
  std::thread sender;
  SentLog sent_log;                            // the sender's
  std::atomic<std::int64_t> frames_sent{0}, frames_unsent{0}, late{0}, max_late_ns{0};
  std::atomic<bool> sender_failed{false};
  std::string sender_error;

  std::atomic<std::int64_t> measured{0};       // MEASUREMENT messages heard
  std::atomic<std::int64_t> handed{0};         // frames given to the sender
  std::int64_t frames_not_whole{0};            // without pixels, or not all of them: not sent
  std::int64_t stalls{0};                      // waits for an answer that never came

  std::int64_t host0_ns{0}, flight0_ns{0};     // anchor: flight0 is due at host0
  double speed{1};
  std::int64_t shift_ns{0};                    // added to every stamp
  std::uint64_t id_base{0};                    // flight's frame number that is block 1
  bool id_known{false}, jumped{false};
  bool tick_jumped{false};                     // by a seek or a loop: the camera's clock knows nothing of it
  std::uint64_t last_block{0};
  std::int64_t first_arrival_ns{0};
  std::int64_t last_arrival_ns{0};             // shifted
  std::int64_t last_exposure_ns{0};            // arrival of the last edge, or frame where there is no strobe; shifted
  std::int64_t tick_shift_ns{0};               // of the camera's clock, which runs at a rate of its own
  std::int64_t last_tick_ns{0}, tick_step_ns{0};
  std::int64_t played_ns{0}, wall0_ns{0}, paused_ns{0};
  std::int64_t loops{0}, seeks{0};
  std::atomic<std::uint32_t> acquisitions{0};
  std::uint32_t acquisition_seen{0};

  std::deque<Time> unexposed;                  // strobe times, shifted, at which this camera did not expose
  std::int64_t exposures{0};                   // counted while the rate is lower than the flight's
  std::int64_t frames_unexposed{0};
  std::multimap<std::int64_t, std::function<void()>> later;  // by shifted arrival: what a fault holds back
  std::map<std::string, ChannelCount> channels;
  std::mutex latest_mutex;
  std::map<std::string, std::vector<std::uint8_t>> latest;   // kept only for a script with floods
  std::vector<Delayed<StrobeEdge>> edges;      // scratch
  std::vector<Delayed<tspi_t>> reports;        // scratch

  // replay_outputs.cpp
  void send_frames();
  Result<> handle(const record::LogEvent& e);
  Result<> frame(const record::LogEvent& e);
  Result<> open_lines();
  [[nodiscard]] bool has_strobe() const { return strobe != nullptr || strobe_line != nullptr; }
  void edge(const record::LogEvent& e);
  void put_edge(const StrobeEdge& edge);
  void acquisition(const record::LogEvent& e);
  void tspi(const record::LogEvent& e);
  void mark(const record::LogEvent& e);
  [[nodiscard]] bool exposes();
  [[nodiscard]] bool not_exposed(const FrameInfo& info);
  [[nodiscard]] std::int64_t camera_tick(std::int64_t tick_ns);
  [[nodiscard]] int thinning() const;          ///< 1: every frame of the flight
  [[nodiscard]] double exposure_factor() const;
  void fault_changed(const Fault& fault, bool on);
  void publish(const std::string& name, const std::vector<std::uint8_t>& bytes);
  template <class Message>
  void publish_message(const std::string& name, const Message& m);
  void after(Duration delay, std::function<void()> send);

  // replay_play.cpp
  Result<> play(const std::function<void(const ReplayProgress&)>& progress);
  void note_late(std::int64_t due_ns);
  std::int64_t due(std::int64_t arrival_ns) const { return host0_ns + static_cast<std::int64_t>(static_cast<double>(arrival_ns - flight0_ns) / speed); }
  void anchor(std::int64_t arrival_ns) { flight0_ns = arrival_ns; host0_ns = monotonic_ns(); }
  bool wait_control(std::int64_t arrival_ns);
  void wait_due(std::int64_t arrival_ns);
  void send_later(std::int64_t until_ns);
  void wait_answer();
  Result<bool> next_event(record::LogEvent& e);
  Result<bool> jump(record::LogEvent& e);
  void show(const std::function<void(const ReplayProgress&)>& progress, std::int64_t arrival_ns, std::int64_t& next);
  void wait_for_client_to_leave() const;
};

}  // namespace cyclops::hil
