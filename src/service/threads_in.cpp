// The threads that bring things in from devices: camera, strobe, PPS. From LCM: link.cpp.
#include <chrono>
#include <span>

#include "base/log.hpp"
#include "service/pipeline_state.hpp"

namespace cyclops {
namespace {

constexpr Duration kPatience = Duration::from_ms(100);

}  // namespace

void Pipeline::State::run_camera() {
  log::Throttle absent(10);
  std::uint64_t held = 0;
  std::int64_t failures = 0;
  while (!stopping && !camera) {
    auto opened = CameraSource::open(rig.device);
    if (opened.ok()) {
      camera = std::make_unique<CameraSource>(std::move(opened).value());
      break;
    }
    events.post(service_now(), EventLevel::kFault, "camera", "camera.absent", opened.error().message(), ++failures);
    if (absent.pass(host_now_ns(), held)) log::warning("camera", opened.error().message() + "; waiting for it");
    for (int i = 0; i < 5 && !stopping; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  bool flushed = true;
  std::int64_t last_ns = host_now_ns();
  while (!stopping && camera) {
    CameraEvent event = camera->poll(kPatience);
    const std::int64_t now = host_now_ns();
    if (auto* frame = std::get_if<CameraFrame>(&event)) {
      offer(TimedFrame{std::move(*frame), now});
      last_ns = now;
      last_frame_host_ns = now;
      flushed = false;
    } else if (auto* started = std::get_if<CameraStarted>(&event)) {
      camera_there = true;
      offer(AcquisitionStarted{strobe_clock ? Time{INT64_MIN} : Time{now}});
      events.post(service_now(), started->stream > 1 ? EventLevel::kRecovery : EventLevel::kInfo, "camera", "camera.started",
                  started->camera + ", packets of " + std::to_string(started->packet_bytes) + " bytes, away " + std::to_string(started->away.seconds()) + " s", started->stream);
      log::info("camera", "streaming from " + started->camera);
    } else if (auto* lost = std::get_if<CameraLost>(&event)) {
      camera_there = false;
      offer(Idle{});
      events.post(service_now(), EventLevel::kFault, "camera", "camera.lost", std::string(to_string(lost->reason)) + (lost->detail.empty() ? "" : ": " + lost->detail));
      log::warning("camera", std::string("lost: ") + to_string(lost->reason) + " " + lost->detail);
    } else if (auto* fault = std::get_if<CameraFault>(&event)) {
      events.post(service_now(), EventLevel::kFault, "camera", "camera.fault", fault->error.message());
      if (absent.pass(now, held)) log::error("camera", fault->error.message());
    }
    if (!flushed && static_cast<double>(now - last_ns) * 1e-9 > options.idle_flush_s) {
      offer(Idle{});
      flushed = true;
    }
    const CameraCounters counters = camera->counters();
    const std::lock_guard lock(counts_mutex);
    camera_counts = counters;
  }
}

/// Reads one line until the service stops; `take` gets what was read, `status` is kept under the counts' mutex.
template <class Take>
void read_line(Pipeline::State& s, StrobeSource& source, const char* name, StrobeStatus& status, Take take) {
  std::array<StrobeEdge, 64> edges;
  log::Throttle trouble(10);
  std::uint64_t held = 0;
  while (!s.stopping) {
    auto ready_edges = source.wait(kPatience);
    Result<std::size_t> n = std::size_t{0};
    if (ready_edges.ok() && *ready_edges) n = source.read_many(edges);
    const Error* error = !ready_edges.ok() ? &ready_edges.error() : !n.ok() ? &n.error() : nullptr;
    if (error != nullptr) {
      s.events.post(s.service_now(), EventLevel::kFault, name, (std::string(name) + ".lost").c_str(), error->message());
      if (trouble.pass(host_now_ns(), held)) log::error(name, error->message());
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      (void)source.open().ok();
      continue;
    }
    take(std::span<const StrobeEdge>(edges.data(), *n));
    const std::lock_guard lock(s.counts_mutex);
    status = source.status();
  }
}

void Pipeline::State::run_strobe() {
  std::array<FrameArrival, 64> arrivals;
  read_line(*this, *strobe, "strobe", strobe_status, [&](std::span<const StrobeEdge> edges) {
    const std::size_t m = strobe->take_arrivals(arrivals);
    for (std::size_t i = 0; i < m; ++i) offer(FrameArrival(arrivals[i]));
    for (const StrobeEdge& e : edges) offer(StrobeEdge(e));
  });
}

void Pipeline::State::run_pps() {
  std::array<FrameArrival, 64> of_the_strobe;
  read_line(*this, *pps, "pps", pps_status, [&](std::span<const StrobeEdge> edges) {
    (void)pps->take_arrivals(of_the_strobe);
    for (const StrobeEdge& e : edges) offer(PpsEdge{e});
  });
}

}  // namespace cyclops
