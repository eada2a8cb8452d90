#include "service/pipeline.hpp"

#include <pthread.h>

#include <nlohmann/json.hpp>

#include "base/clock.hpp"
#include "service/link.hpp"
#include "service/pipeline_state.hpp"

namespace cyclops {
namespace {

using nlohmann::json;

json quantiles(const Histogram& h, double scale) {
  return {{"p50", static_cast<double>(h.quantile(0.5).ns) * scale},
          {"p99", static_cast<double>(h.quantile(0.99).ns) * scale},
          {"max", static_cast<double>(h.max().ns) * scale}};
}

/// Before the others, if this user may: the kernel keeps only so many edges for a reader that does not come.
void prefer(std::thread& t) {
  const sched_param p{.sched_priority = 20};
  (void)pthread_setschedparam(t.native_handle(), SCHED_FIFO, &p);
}
void name_thread(std::thread& t, const char* name) { pthread_setname_np(t.native_handle(), name); }

}  // namespace

std::int64_t host_now_ns() { return steady_now_ns(); }

std::size_t WaitingRoom::put(TimedFrame&& frame) {
  for (std::size_t i = 0; i < kPlaces; ++i)
    if (!places_[i]) {
      places_[i].emplace(std::move(frame));
      ++used_;
      return i;
    }
  return kPlaces;
}

TimedFrame WaitingRoom::take(std::size_t place) {
  CYCLOPS_ASSERT(place < kPlaces && places_[place].has_value());
  TimedFrame out = std::move(*places_[place]);
  places_[place].reset();
  --used_;
  return out;
}

Pipeline::State::State(Rig r, Profile p, ServiceOptions o) : rig(std::move(r)), profile(std::move(p)), options(std::move(o)) {
  for (std::size_t i = 0; i < spare.places(); ++i) CYCLOPS_ASSERT(spare.try_push(std::make_unique<Finished>()));
}

Pipeline::State::~State() = default;

void Pipeline::State::offer(Input&& input) {
  const std::size_t kind = input.index();
  if (inputs.try_push(std::move(input))) return;
  const std::lock_guard lock(counts_mutex);
  ++inputs_refused[kind];
}

Pipeline::Pipeline(Rig rig, Profile profile, ServiceOptions options)
    : s_(std::make_unique<State>(std::move(rig), std::move(profile), std::move(options))) {}

Pipeline::~Pipeline() { (void)stop().ok(); }

Result<> Pipeline::start() {
  State& s = *s_;
  s.strobe = make_strobe_source(s.rig.strobe);
  if (s.strobe) {
    CYCLOPS_TRY(s.strobe->open());
    s.strobe_clock = s.strobe->has_own_clock();
  }
  s.pps = make_strobe_source(s.rig.pps);
  if (s.pps) CYCLOPS_TRY(s.pps->open());
  s.lcm = lcm_create(s.options.lcm_url.empty() ? nullptr : s.options.lcm_url.c_str());
  if (s.lcm == nullptr)
    return make_error(ErrorCode::kIo, "lcm " + s.options.lcm_url, "cannot be opened: is the URL right, and is multicast routed (ip route add 224.0.0.0/4 dev lo)?");
  s.doors = std::make_unique<LinkDoors>(s);
  s.doors->open(s.lcm);
  if (!s.options.record.folder.empty()) {
    // Frames that wait for the disk must not be missing in the camera's pool.
    s.rig.device.buffers = std::min(64, s.rig.device.buffers + static_cast<int>(Recorder::kFramePlaces));
    auto recorder = Recorder::start(s.options.record, s.rig, s.profile.name, s.options.profile_path, s.strobe_clock, s.events);
    if (!recorder.ok()) return recorder.error();
    s.recorder = std::move(recorder).value();
  }
  s.started_ns = host_now_ns();
  s.publish_thread = std::thread(&State::run_publish, &s);
  s.chain_thread = std::thread(&State::run_chain, &s);
  s.link_thread = std::thread(&State::run_link, &s);
  if (s.strobe) s.strobe_thread = std::thread(&State::run_strobe, &s);
  if (s.pps) s.pps_thread = std::thread(&State::run_pps, &s);
  s.camera_thread = std::thread(&State::run_camera, &s);
  name_thread(s.publish_thread, "publish");
  name_thread(s.chain_thread, "chain");
  name_thread(s.link_thread, "link");
  if (s.strobe) name_thread(s.strobe_thread, "strobe");
  if (s.pps) name_thread(s.pps_thread, "pps");
  for (std::thread* t : {&s.strobe_thread, &s.pps_thread})
    if (t->joinable()) prefer(*t);
  name_thread(s.camera_thread, "camera");
  return Ok{};
}

Result<> Pipeline::stop() {
  State& s = *s_;
  if (s.stopping.exchange(true)) return Ok{};
  for (std::thread* t : {&s.camera_thread, &s.strobe_thread, &s.pps_thread, &s.link_thread})
    if (t->joinable()) t->join();
  s.inputs.close();
  if (s.chain_thread.joinable()) s.chain_thread.join();
  s.ready.close();
  if (s.publish_thread.joinable()) s.publish_thread.join();
  const Result<> recorded = s.recorder ? s.recorder->stop() : Result<>(Ok{});
  if (s.recorder) s.record_counts = s.recorder->counts();
  s.recorder.reset();
  s.camera.reset();
  if (s.lcm != nullptr) lcm_destroy(s.lcm);
  s.lcm = nullptr;
  return recorded;
}

std::uint64_t Pipeline::frames() const { return s_->frames.load(); }

double Pipeline::idle_s() const {
  const std::int64_t last = s_->last_frame_host_ns.load();
  return last == 0 ? 0.0 : static_cast<double>(host_now_ns() - last) * 1e-9;
}

std::string Pipeline::summary() const {
  const State& s = *s_;
  const CameraCounters& c = s.camera_counts;
  const ChainCounts& n = s.chain_counts;
  json j;
  j["version"] = CYCLOPS_VERSION;
  j["profile"] = s.profile.name;
  j["frames_received"] = c.received + c.incomplete;
  j["frames_complete"] = c.received;
  j["frames_incomplete"] = c.incomplete;
  j["frames_lost_by_cause"] = {{"gap", c.lost_gap}, {"leader", c.lost_leader}, {"no_buffer", c.lost_no_buffer}, {"size_mismatch", c.lost_size_mismatch},
                               {"rows_unknown", c.lost_rows_unknown}, {"frozen", c.lost_frozen}, {"queue_full", s.refused<TimedFrame>()}, {"no_room", n.front_refused}};
  j["room_flushed"] = n.room_flushed;
  j["frames_in_chain"] = n.frames;
  j["inputs_refused"] = {{"frames", s.refused<TimedFrame>()}, {"edges", s.refused<StrobeEdge>()}, {"arrivals", s.refused<FrameArrival>()},
                         {"tspi", s.refused<ArrivedTspi>()}, {"time_marks", s.refused<TimeMark>()}};
  j["nav_updates"] = n.nav_updates;
  j["frames_with_consensus"] = n.consensus;
  j["camera"] = {{"starts", c.starts}, {"losses", c.losses}, {"failed_opens", c.failed_opens}, {"resent_packets", c.packets.resent}, {"missing_packets", c.packets.missing}};
  j["time"] = {{"by_strobe", n.stamp.by_source[0]}, {"by_camera_tick", n.stamp.by_source[1]}, {"by_arrival", n.stamp.by_source[2]}, {"unknown", n.stamp.by_source[3]},
               {"edges", n.stamp.edges}, {"locks", n.stamp.lock_count}, {"gps_marks", n.gps.marks}, {"gps_relocks", n.gps.relocks},
               {"gps_drift_ppm", n.clocks.gps_drift_ppm}, {"gps_sigma_us", n.clocks.gps_sigma.seconds() * 1e6}, {"camera_drift_ppm", n.clocks.camera_drift_ppm},
               {"edge_scatter_us", n.clocks.edge_scatter_us}, {"edges_lost", s.strobe_status.lost}, {"pps_edges", n.pps.edges}, {"pps_marks", n.pps.marks}};
  for (int a = 0; a < 2; ++a)
    j["tspi"][a == 0 ? "receiver" : "tanker"] = {{"received", s.link_counts[a].received}, {"refused", s.link_counts[a].refused}, {"guarded", s.link_counts[a].guarded},
                                                 {"flooded", s.link_counts[a].flooded}, {"not_authentic", s.link_counts[a].not_authentic}, {"replayed", s.link_counts[a].replayed},
                                                 {"accepted", n.tspi[a].accepted}, {"out_of_order", n.tspi[a].out_of_order_inserted}, {"duplicate", n.tspi[a].duplicate},
                                                 {"missing", n.tspi[a].missing}, {"too_old", n.tspi[a].too_old}, {"held_back", n.tspi[a].held_back},
                                                 {"jumps", n.tspi[a].jump_forward + n.tspi[a].jump_back}};
  j["tspi"]["without_clock"] = n.front.tspi_without_clock;
  j["tracks"] = {{"initiated", n.track.initiated}, {"dropped", n.track.dropped}, {"left_image", n.track.left_image}};
  j["latency_ms"] = quantiles(s.latency, 1e-6);
  for (std::size_t i = 0; i < kStages; ++i) j["stage_us"][to_string(static_cast<Stage>(i))] = quantiles(s.stage[i], 1e-3);
  j["stage_us"]["chain"] = quantiles(s.chain_time, 1e-3);
  if (const RecordCounts& r = s.record_counts; r.on)
    j["record"] = {{"frames", r.frames}, {"frames_lost_by_cause", {{"queue_full", r.frames_queue_full}, {"disk_full", r.frames_disk_full}, {"disk_error", r.frames_disk_error}}},
                   {"inputs", r.inputs}, {"inputs_lost", r.inputs_lost}, {"published", r.published}, {"published_lost", r.published_lost}, {"frame_bytes", r.bytes}};
  j["publish_failed"] = s.publish_failed;
  j["events_lost"] = s.events.lost();
  j["queue_high_water"] = {{"inputs", s.inputs.high_water()}, {"ready", s.ready.high_water()}};
  return j.dump(2);
}

}  // namespace cyclops
