#include "hil/replayer.hpp"

#include <chrono>

#include "hil/replay_state.hpp"
#include "wire/channels.hpp"

namespace cyclops::hil {

Replayer::State::State(const ReplayOptions& o, FlightReader f, FlightReader p, Rig r, FaultScript script)
    : options(o), flight(std::move(f)), pixels(std::move(p)), rig(std::move(r)), faults(std::move(script)), camera_faults(faults), input_faults(faults) {}

Replayer::State::~State() {
  jobs.close();
  if (sender.joinable()) sender.join();
  host_faults.reset();
  if (lcm != nullptr) lcm_destroy(lcm);
}

Replayer::Replayer(std::unique_ptr<State> state) : s_(std::move(state)) {}
Replayer::~Replayer() = default;

namespace {

GigeConfig device_of(const Rig& rig, const std::string& address) {
  GigeConfig config;
  config.address = address.empty() ? rig.device.address : address;
  config.width = rig.device.width_px;
  config.height = rig.device.height_px;
  config.format = rig.device.format;
  config.frame_rate_hz = rig.device.frame_rate_hz;
  config.exposure_us = rig.device.exposure_us;
  return config;
}

}  // namespace

Result<std::unique_ptr<Replayer>> Replayer::open(const ReplayOptions& options) {
  FaultScript script;
  if (!options.faults.empty()) {
    auto loaded = FaultScript::load(options.faults);
    if (!loaded.ok()) return loaded.error();
    script = std::move(loaded).value();
  }
  auto flight = FlightReader::open(options.flight);
  if (!flight.ok()) return flight.error();
  auto pixels = FlightReader::open(options.flight);
  if (!pixels.ok()) return pixels.error();
  auto rig = Rig::load(flight->path("rig.toml"));
  if (!rig.ok()) return rig.error();
  auto state = std::make_unique<State>(options, std::move(flight).value(), std::move(pixels).value(), std::move(rig).value(), std::move(script));
  State& s = *state;
  s.control.paused = options.paused;
  s.control.speed = s.speed = options.speed;
  CYCLOPS_TRY(s.sent_log.open(options.sent_path));
  if (!options.gpio_sim.empty()) {
    CYCLOPS_TRY(s.open_lines());
  } else if (s.rig.strobe.kind == StrobeKind::kSocket) {
    auto server = StrobeServer::open(s.rig.strobe.socket);
    if (!server.ok()) return server.error();
    s.strobe = std::make_unique<StrobeServer>(std::move(server).value());
  }
  s.lcm = lcm_create(options.lcm_url.empty() ? nullptr : options.lcm_url.c_str());
  if (s.lcm == nullptr) return make_error(ErrorCode::kIo, "lcm " + options.lcm_url, "cannot be opened");
  s.host_faults = std::make_unique<FaultHost>(s.faults, options.lcm_url, [&s](const std::string& name) {
    const std::lock_guard lock(s.latest_mutex);
    return s.latest[name];
  });
  s.device = std::make_unique<GigeDevice>(device_of(s.rig, options.address));
  s.device->on_acquisition([&s](bool on) { if (on) ++s.acquisitions; });
  if (!options.faults.empty()) s.device->set_fault([&s](const PacketRef& p) { return s.camera_faults.packet(p); });
  s.faults.on_change([&s](const Fault& fault, bool on) { s.fault_changed(fault, on); });
  CYCLOPS_TRY(s.device->start());
  s.sender = std::thread(&State::send_frames, &s);
  return std::unique_ptr<Replayer>(new Replayer(std::move(state)));
}

Result<> Replayer::run(const std::function<void(const ReplayProgress&)>& progress) {
  State& s = *s_;
  if (!s.device->wait_streaming(s.options.wait_for_client))
    return make_error(ErrorCode::kTimeout, "camera " + s.rig.device.address, "no client started the acquisition within " + std::to_string(s.options.wait_for_client.seconds()) + " s");
  lcm_subscribe(s.lcm, channel::kMeasurement, [](const lcm_recv_buf_t*, const char*, void* state) { ++static_cast<State*>(state)->measured; }, &s);
  if (s.options.start_s > 0) CYCLOPS_TRY(s.flight.seek(Time{s.flight.manifest().first_frame_ns + static_cast<std::int64_t>(s.options.start_s * 1e9)}));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the client's strobe and LCM sockets come up
  if (s.faults.has(FaultKind::kCpuLoad)) prefer_this_thread();
  s.wall0_ns = monotonic_ns();
  CYCLOPS_TRY(s.play(progress));
  const std::int64_t end = monotonic_ns();
  s.jobs.close();
  if (s.sender.joinable()) s.sender.join();
  s.wall0_ns = end - s.wall0_ns - s.paused_ns;  // now the length of the run
  if (s.sender_failed) return make_error(ErrorCode::kIo, s.options.flight, s.sender_error);
  s.wait_for_client_to_leave();
  return s.sent_log.finish();
}

void Replayer::pause() { const std::lock_guard lock(s_->control.mutex); s_->control.paused = true; }
void Replayer::play() {
  { const std::lock_guard lock(s_->control.mutex); s_->control.paused = false; s_->control.steps = 0; }
  s_->control.changed.notify_all();
}
void Replayer::step(int frames) {
  { const std::lock_guard lock(s_->control.mutex); s_->control.steps = frames; s_->control.paused = false; }
  s_->control.changed.notify_all();
}
void Replayer::set_speed(double speed) { const std::lock_guard lock(s_->control.mutex); s_->control.speed = speed; s_->control.speed_changed = true; }
void Replayer::seek(double flight_s) {
  { const std::lock_guard lock(s_->control.mutex); s_->control.seek_s = flight_s; }
  s_->control.changed.notify_all();
}
void Replayer::quit() {
  { const std::lock_guard lock(s_->control.mutex); s_->control.quit = true; }
  s_->control.changed.notify_all();
}

nlohmann::json Replayer::summary() const {
  const State& s = *s_;
  const GigeStats g = s.device->stats();
  const auto pulses = [](const auto& line) { return line ? line->pulses() : 0; };
  const double wall = static_cast<double>(s.wall0_ns) * 1e-9;
  nlohmann::json channels;
  for (const auto& [name, count] : s.channels) channels[name] = {{"offered", count.offered}, {"sent", count.sent}, {"failed", count.failed}};
  return {{"flight", s.flight.manifest().name},
          {"frames_in_flight", s.flight.manifest().frames},
          {"frames_served", s.frames_sent.load()},
          {"frames_unsent", s.frames_unsent.load()},
          {"frames_not_whole", s.frames_not_whole},
          {"frames_unexposed", s.frames_unexposed},
          {"acquisitions", s.acquisitions.load()},
          {"speed", s.options.speed},
          {"realtime_factor", wall > 0 ? static_cast<double>(s.played_ns) * 1e-9 / wall : 0.0},
          {"late", s.late.load()},
          {"max_late_ms", static_cast<double>(s.max_late_ns.load()) * 1e-6},
          {"loops", s.loops},
          {"seeks", s.seeks},
          {"stalls", s.stalls},
          {"resent_packets", g.resent_packets},
          {"gpio_pulses", pulses(s.strobe_line)},
          {"gpio_pps_pulses", pulses(s.pps_line)},
          {"edges", s.strobe ? s.strobe->counters().edges : 0},
          {"edges_without_client", s.strobe ? s.strobe->counters().no_client : 0},
          {"edges_undelivered", s.strobe ? s.strobe->counters().undelivered : 0},
          {"channels", channels},
          {"faults", s.faults.report()}};
}

}  // namespace cyclops::hil
