#pragma once
/// Inside service: what the threads of the pipeline share.
#include <array>
#include <atomic>
#include <mutex>
#include <thread>

#include <lcm/lcm.h>

#include "base/bounded_queue.hpp"
#include "service/counts.hpp"
#include "service/events.hpp"
#include "service/inputs.hpp"
#include "service/pipeline.hpp"
#include "service/publisher.hpp"
#include "service/recorder.hpp"

namespace cyclops {

[[nodiscard]] std::int64_t host_now_ns();   ///< CLOCK_MONOTONIC

class LinkDoors;

struct Finished {                            ///< one frame on its way to the network
  FrameOutput out{};
  std::optional<GpsTime> t_mid_gps{};
  std::optional<CameraFrame> pixels{};       ///< only when a thumbnail or a record is wanted
  bool thumbnail{false};
  std::int64_t number{-1};                   ///< of the pixels in the record
  std::int64_t complete_ns{0};
};

/// Frames that wait inside the chain's thread, by token.
class WaitingRoom {
 public:
  static constexpr std::size_t kPlaces = 20;
  std::size_t put(TimedFrame&& frame);       ///< kPlaces when full: the frame is untouched
  TimedFrame take(std::size_t place);
  [[nodiscard]] std::size_t used() const { return used_; }

 private:
  std::array<std::optional<TimedFrame>, kPlaces> places_{};
  std::size_t used_{0};
};

struct Pipeline::State {
  State(Rig r, Profile p, ServiceOptions o);
  ~State();

  Rig rig;
  Profile profile;
  ServiceOptions options;
  EventBus events;
  std::atomic<bool> stopping{false};
  std::atomic<std::uint64_t> frames{0};
  std::atomic<std::int64_t> last_frame_host_ns{0};
  std::atomic<bool> camera_there{false};

  std::unique_ptr<StrobeSource> strobe;
  std::unique_ptr<StrobeSource> pps;         ///< null when the rig has none
  bool strobe_clock{false};                  ///< arrivals come from the strobe source
  std::unique_ptr<CameraSource> camera;      ///< dies after every frame of it
  std::unique_ptr<Recorder> recorder;        ///< null: nothing is recorded; dies before the camera
  lcm_t* lcm{nullptr};
  std::unique_ptr<LinkDoors> doors;          ///< subscribed to lcm

  BoundedQueue<Input> inputs{512};
  BoundedQueue<std::unique_ptr<Finished>> ready{8};
  BoundedQueue<std::unique_ptr<Finished>> spare{8};

  mutable std::mutex counts_mutex;           // the six below are read and written under it
  ChainCounts chain_counts{};
  CameraCounters camera_counts{};
  StrobeStatus strobe_status{};
  StrobeStatus pps_status{};
  LinkCounts link_counts[kLinks]{};
  std::array<std::uint64_t, std::variant_size_v<Input>> inputs_refused{};  // by kind

  // of the publish thread, read after it has ended
  Histogram stage[kStages];
  Histogram chain_time, latency;
  RecentHistogram latency_recent, chain_recent;
  FrameFacts facts{};
  std::int64_t last_published_ns{0};         ///< newest frame's results on the network
  std::uint64_t publish_failed{0};
  std::int64_t started_ns{0};
  RecordCounts record_counts{};              ///< after the end

  std::thread camera_thread, strobe_thread, pps_thread, link_thread, chain_thread, publish_thread;

  void run_camera();
  void run_strobe();
  void run_pps();
  void run_link();
  void run_chain();
  void run_publish();
  void offer(Input&& input);
  /// Inputs of one kind that found the queue full; under the mutex, or when every thread has ended.
  template <class Kind>
  [[nodiscard]] std::uint64_t refused() const { return inputs_refused[input_index<Kind>()]; }
  [[nodiscard]] Time service_now() const { return Time{host_now_ns()}; }
};

}  // namespace cyclops
