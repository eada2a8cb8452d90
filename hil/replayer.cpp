#include "hil/replayer.hpp"

#include <condition_variable>
#include <mutex>
#include <thread>

#include <lcm/lcm.h>

#include <cyclops/time_mark_t.hpp>
#include <cyclops/tspi_t.hpp>

#include "base/bounded_queue.hpp"
#include "hil/gige_device.hpp"
#include "hil/gpio_sim.hpp"
#include "hil/strobe_server.hpp"
#include "record/flight.hpp"
#include "service/rig.hpp"
#include "wire/codec.hpp"

namespace cyclops::hil {
namespace {

struct FrameJob {
  std::int64_t number{0};          ///< in frames.lcm
  std::uint64_t block_id{0};
  std::int64_t tick_ns{0};
  std::int64_t due_ns{0};          ///< 0: now
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

}  // namespace

struct Replayer::State {
  State(const ReplayOptions& o, FlightReader f, FlightReader p, Rig r) : options(o), flight(std::move(f)), pixels(std::move(p)), rig(std::move(r)) {}
  ~State() {
    jobs.close();
    if (sender.joinable()) sender.join();
    if (lcm != nullptr) lcm_destroy(lcm);
  }

  ReplayOptions options;
  FlightReader flight;             // messages, read by run()
  FlightReader pixels;             // frames, read by the sender
  Rig rig;
  std::unique_ptr<GigeDevice> device;
  std::unique_ptr<StrobeServer> strobe;
  std::unique_ptr<GpioSimLine> strobe_line, pps_line;
  lcm_t* lcm{nullptr};
  Control control;

  BoundedQueue<FrameJob> jobs{4};
  std::thread sender;
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
  std::uint64_t last_block{0};
  std::int64_t last_arrival_ns{0};             // shifted
  std::int64_t played_ns{0}, wall0_ns{0}, paused_ns{0};
  std::int64_t loops{0}, seeks{0};
  std::atomic<std::uint32_t> acquisitions{0};
  std::uint32_t acquisition_seen{0};

  void send_frames();
  Result<> open_lines();
  void mark(time_mark_t& m, const std::vector<std::uint8_t>& bytes);
  Result<> handle(const record::LogEvent& e);
  Result<> frame(const record::LogEvent& e);
  void edge(const record::LogEvent& e);
  void acquisition(const record::LogEvent& e);
  void publish(const char* name, const std::vector<std::uint8_t>& bytes) { lcm_publish(lcm, name, bytes.data(), static_cast<unsigned>(bytes.size())); }
  template <class Message>
  void publish_moved(const char* name, Message& m, const std::vector<std::uint8_t>& bytes);
  void note_late(std::int64_t due_ns);
  std::int64_t due(std::int64_t arrival_ns) const { return host0_ns + static_cast<std::int64_t>(static_cast<double>(arrival_ns - flight0_ns) / speed); }
  void anchor(std::int64_t arrival_ns) { flight0_ns = arrival_ns; host0_ns = monotonic_ns(); }
  bool wait_control(std::int64_t arrival_ns);
  void wait_due(std::int64_t arrival_ns);
  void wait_answer();
  Result<bool> next_event(record::LogEvent& e);
  void jump(std::int64_t arrival_ns);
};

Replayer::Replayer(std::unique_ptr<State> state) : s_(std::move(state)) {}
Replayer::~Replayer() = default;

Result<std::unique_ptr<Replayer>> Replayer::open(const ReplayOptions& options) {
  auto flight = FlightReader::open(options.flight);
  if (!flight.ok()) return flight.error();
  auto pixels = FlightReader::open(options.flight);
  if (!pixels.ok()) return pixels.error();
  auto rig = Rig::load(flight->path("rig.toml"));
  if (!rig.ok()) return rig.error();
  auto state = std::make_unique<State>(options, std::move(flight).value(), std::move(pixels).value(), std::move(rig).value());
  State& s = *state;
  s.control.paused = options.paused;
  s.control.speed = s.speed = options.speed;
  if (!options.gpio_sim.empty()) {
    CYCLOPS_TRY(s.open_lines());
  } else if (s.rig.strobe.kind == StrobeKind::kSocket) {
    auto server = StrobeServer::open(s.rig.strobe.socket);
    if (!server.ok()) return server.error();
    s.strobe = std::make_unique<StrobeServer>(std::move(server).value());
  }
  s.lcm = lcm_create(options.lcm_url.empty() ? nullptr : options.lcm_url.c_str());
  if (s.lcm == nullptr) return make_error(ErrorCode::kIo, "lcm " + options.lcm_url, "cannot be opened");
  GigeConfig config;
  config.address = options.address.empty() ? s.rig.device.address : options.address;
  config.width = s.rig.device.width_px;
  config.height = s.rig.device.height_px;
  config.format = s.rig.device.format;
  config.frame_rate_hz = s.rig.device.frame_rate_hz;
  config.exposure_us = s.rig.device.exposure_us;
  s.device = std::make_unique<GigeDevice>(config);
  s.device->on_acquisition([&s](bool on) { if (on) ++s.acquisitions; });
  CYCLOPS_TRY(s.device->start());
  s.sender = std::thread(&State::send_frames, &s);
  return std::unique_ptr<Replayer>(new Replayer(std::move(state)));
}

void Replayer::State::send_frames() {
  std::vector<std::uint8_t> memory;
  while (auto job = jobs.pop(Duration::from_seconds(3600))) {
    FlightFrame frame;
    if (auto read = pixels.frame(job->number, memory, frame); !read.ok()) {
      sender_error = read.error().message();
      sender_failed = true;
      return;
    }
    const SendReport report = device->send({job->block_id, job->tick_ns, frame.image}, job->due_ns);
    if (!report.sent) ++frames_unsent;
    else ++frames_sent;
    if (report.late.ns > max_late_ns) max_late_ns = report.late.ns;
    if (report.late > options.late_after) ++late;
  }
}

void Replayer::State::note_late(std::int64_t due_ns) {
  const std::int64_t over = monotonic_ns() - due_ns;
  if (over > max_late_ns) max_late_ns = over;
  if (over > options.late_after.ns) ++late;
}

/// Seek, pause, step and speed; false when it is time to quit.
bool Replayer::State::wait_control(std::int64_t arrival_ns) {
  std::unique_lock lock(control.mutex);
  if (control.speed_changed) {
    control.speed_changed = false;
    speed = control.speed;
    anchor(arrival_ns);
    while (lcm_handle_timeout(lcm, 0) > 0) {}  // answers of the time when nobody counted them
    measured = handed.load();
  }
  if (control.paused && !control.quit && control.seek_s < 0) {
    const std::int64_t begin = monotonic_ns();
    control.changed.wait(lock, [this] { return !control.paused || control.quit || control.seek_s >= 0; });
    paused_ns += monotonic_ns() - begin;
    speed = control.speed;
    anchor(arrival_ns);
  }
  return !control.quit;
}

void Replayer::State::wait_due(std::int64_t arrival_ns) {
  if (speed <= 0) return;
  while (true) {  // in short sleeps, so that pause and quit are heard
    const std::int64_t left = due(arrival_ns) - monotonic_ns();
    if (left <= 0) break;
    if (left > 50'000'000) {
      std::this_thread::sleep_for(std::chrono::milliseconds(40));
      const std::lock_guard lock(control.mutex);
      if (control.quit || control.paused || control.seek_s >= 0 || control.speed_changed) return;
      continue;
    }
    sleep_until_ns(due(arrival_ns));
    break;
  }
  note_late(due(arrival_ns));
}

/// As fast as the service answers.
void Replayer::State::wait_answer() {
  const std::int64_t until = monotonic_ns() + 2'000'000'000;
  while (handed - measured >= options.most_ahead) {
    if (lcm_handle_timeout(lcm, 50) < 0 || monotonic_ns() > until) {
      measured = handed.load();  // it does not answer: go on, and say so
      ++stalls;
      return;
    }
    const std::lock_guard lock(control.mutex);
    if (control.quit) return;
  }
}

template <class Message>
void Replayer::State::publish_moved(const char* name, Message& m, const std::vector<std::uint8_t>& bytes) {
  if (shift_ns == 0) return publish(name, bytes);
  std::vector<std::uint8_t> moved(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(moved.data(), 0, static_cast<int>(moved.size()));
  publish(name, moved);
}

void Replayer::State::edge(const record::LogEvent& e) {
  const auto decoded = decode_strobe_edge(e.data.data(), e.data.size());
  if (decoded.ok() && strobe_line && decoded->line == StrobeLine::kStrobe && device->streaming()) strobe_line->pulse();
  if (!decoded.ok() || !strobe || !device->streaming()) return;  // a camera that does not expose has no strobe
  StrobeEdge out = decoded->edge;
  out.t = out.t + Duration{shift_ns};
  if (shift_ns != 0) out.line_seq = -1;  // after a jump the numbers of the flight say nothing any more
  strobe->send(out, static_cast<std::uint32_t>(decoded->line == StrobeLine::kStrobe ? rig.strobe.line : rig.pps.line));
}

Result<> Replayer::State::frame(const record::LogEvent& e) {
  const auto index = decode_frame_index(e.data.data(), e.data.size());
  if (!index.ok()) return index.error();
  if (acquisition_seen != acquisitions.load()) {
    acquisition_seen = acquisitions.load();
    id_known = false;
  }
  const std::uint64_t id = index->info.camera_frame_id;
  if (id == 0 || index->info.status != FrameStatus::kComplete || !flight.has_frame(index->recorded_at)) {
    ++frames_not_whole;                               // a gap in the camera's numbers
    return Ok{};
  }
  const bool recorded = flight.manifest().origin == "recorded";
  if (!id_known) id_base = recorded && shift_ns == 0 && id > last_block ? 0 : id - 1;  // a camera counts from 1 after each start
  else if (jumped) id_base = id - last_block - 1;     // and on after a jump of the flight
  id_known = true;
  jumped = false;
  last_block = id - id_base;
  if (strobe) strobe->send_arrival(last_block, index->info.t_arrival + Duration{shift_ns});
  FrameJob job{index->recorded_at, last_block, index->info.camera_tick_ns + shift_ns, 0};
  while (!jobs.try_push(FrameJob(job))) {  // the sender is behind: wait, do not skip
    if (sender_failed) return make_error(ErrorCode::kIo, options.flight, sender_error);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  ++handed;
  if (speed <= 0) wait_answer();
  const std::lock_guard lock(control.mutex);
  if (control.steps > 0 && --control.steps == 0) control.paused = true;
  return Ok{};
}

/// In the record the camera began anew; here its stream goes on, and so do its numbers.
void Replayer::State::acquisition(const record::LogEvent& e) {
  const auto a = decode_acquisition(e.data.data(), e.data.size());
  if (a.ok() && a->what == AcquisitionChange::kStarted && id_known) jumped = true;
}

Result<> Replayer::State::open_lines() {
  if (speed != 1) return make_error(ErrorCode::kInvalid, "--speed", "is " + std::to_string(speed) + ", expected 1 beside --gpio-sim: edges are stamped by this host's clock");
  auto line = GpioSimLine::open(options.gpio_sim, options.gpio_strobe_line);
  if (!line.ok()) return line.error();
  strobe_line = std::move(line).value();
  if (options.gpio_pps_line < 0) return Ok{};
  line = GpioSimLine::open(options.gpio_sim, options.gpio_pps_line);
  if (!line.ok()) return line.error();
  pps_line = std::move(line).value();
  return Ok{};
}

void Replayer::State::mark(time_mark_t& m, const std::vector<std::uint8_t>& bytes) {
  if (pps_line) pps_line->pulse();
  if (!strobe_line && shift_ns == 0) return publish(channel::kTimeMark, bytes);
  m.gps_time_ns += shift_ns;
  m.service_time_ns = strobe_line ? due(m.service_time_ns) : m.service_time_ns + shift_ns;
  std::vector<std::uint8_t> moved(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(moved.data(), 0, static_cast<int>(moved.size()));
  publish(channel::kTimeMark, moved);
}

Result<> Replayer::State::handle(const record::LogEvent& e) {
  if (e.channel == channel::kStrobe) edge(e);
  else if (e.channel == channel::kFrame) CYCLOPS_TRY(frame(e));
  else if (e.channel == channel::kAcquisition) acquisition(e);
  else if (e.channel == channel::kTspiReceiver || e.channel == channel::kTspiTanker) {
    tspi_t m{};
    if (shift_ns == 0 || m.decode(e.data.data(), 0, static_cast<int>(e.data.size())) < 0) publish(e.channel.c_str(), e.data);
    else m.gps_time_ns += shift_ns, publish_moved(e.channel.c_str(), m, e.data);
  } else if (e.channel == channel::kTimeMark) {
    time_mark_t m{};
    if (m.decode(e.data.data(), 0, static_cast<int>(e.data.size())) < 0) publish(e.channel.c_str(), e.data);
    else mark(m, e.data);
  }
  return Ok{};
}

/// The stamps of what follows go on one frame period after what has been played.
void Replayer::State::jump(std::int64_t arrival_ns) {
  if (last_arrival_ns != 0) shift_ns = last_arrival_ns + rig.device.period().ns - arrival_ns;
  anchor(arrival_ns);
  jumped = true;
}

Result<bool> Replayer::State::next_event(record::LogEvent& e) {
  double target = -1;
  {
    const std::lock_guard lock(control.mutex);
    std::swap(target, control.seek_s);
  }
  if (target >= 0) {
    CYCLOPS_TRY(flight.seek(Time{flight.manifest().first_frame_ns + static_cast<std::int64_t>(target * 1e9)}));
    ++seeks;
    auto more = flight.next(e);
    if (more.ok() && *more) jump(e.time_us * 1000);
    return more;
  }
  auto more = flight.next(e);
  if (!more.ok() || *more || !options.loop) return more;
  CYCLOPS_TRY(flight.rewind());
  ++loops;
  more = flight.next(e);
  if (more.ok() && *more) jump(e.time_us * 1000);
  return more;
}

Result<> Replayer::run(const std::function<void(const ReplayProgress&)>& progress) {
  State& s = *s_;
  if (!s.device->wait_streaming(s.options.wait_for_client))
    return make_error(ErrorCode::kTimeout, "camera " + s.rig.device.address, "no client started the acquisition within " + std::to_string(s.options.wait_for_client.seconds()) + " s");
  lcm_subscribe(s.lcm, channel::kMeasurement, [](const lcm_recv_buf_t*, const char*, void* state) { ++static_cast<State*>(state)->measured; }, &s);
  if (s.options.start_s > 0) CYCLOPS_TRY(s.flight.seek(Time{s.flight.manifest().first_frame_ns + static_cast<std::int64_t>(s.options.start_s * 1e9)}));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the client's strobe and LCM sockets come up
  record::LogEvent event;
  bool first = true;
  std::int64_t next_progress = 0, first_arrival = 0;
  s.wall0_ns = monotonic_ns();
  while (true) {
    auto more = s.next_event(event);
    if (!more.ok()) return more.error();
    if (!*more) break;
    const std::int64_t arrival = event.time_us * 1000;
    if (first) {
      first_arrival = arrival;
      s.anchor(arrival);
      first = false;
    }
    if (!s.wait_control(arrival)) break;
    s.wait_due(arrival);
    if (!s.wait_control(arrival)) break;
    CYCLOPS_TRY(s.handle(event));
    s.last_arrival_ns = arrival + s.shift_ns;
    s.played_ns = s.last_arrival_ns - first_arrival;
    if (const std::int64_t now = monotonic_ns(); progress && now > next_progress) {
      next_progress = now + 500'000'000;
      const double wall = static_cast<double>(now - s.wall0_ns - s.paused_ns) * 1e-9;
      const FlightManifest& m = s.flight.manifest();
      progress({static_cast<double>(arrival - m.first_frame_ns) * 1e-9, static_cast<double>(m.last_frame_ns - m.first_frame_ns) * 1e-9, s.handed,
                wall > 0 ? static_cast<double>(s.played_ns) * 1e-9 / wall : 0, s.late, s.control.paused});
    }
    if (s.options.most_frames > 0 && s.handed >= s.options.most_frames) break;
  }
  const std::int64_t end = monotonic_ns();
  s.jobs.close();
  if (s.sender.joinable()) s.sender.join();
  s.wall0_ns = end - s.wall0_ns - s.paused_ns;  // now the length of the run
  if (s.sender_failed) return make_error(ErrorCode::kIo, s.options.flight, s.sender_error);
  // The camera stays for resends of the last frame and until the client has let go of it, or it would wait for answers.
  int quiet = 0;
  for (int tenths = 0; tenths < 80 && quiet < 12; ++tenths) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    quiet = s.device->streaming() ? 0 : quiet + 1;
  }
  return Ok{};
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
  return {{"flight", s.flight.manifest().name},
          {"frames_in_flight", s.flight.manifest().frames},
          {"frames_served", s.frames_sent.load()},
          {"frames_unsent", s.frames_unsent.load()},
          {"frames_not_whole", s.frames_not_whole},
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
          {"edges_without_client", s.strobe ? s.strobe->counters().no_client : 0}};
}

}  // namespace cyclops::hil
