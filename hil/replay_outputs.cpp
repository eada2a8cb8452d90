// What leaves the replayer: frames, edges, messages, each after the faults that are on.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <cyclops/time_mark_t.hpp>
#include <cyclops/tspi_t.hpp>

#include "hil/replay_state.hpp"
#include "wire/codec.hpp"

namespace cyclops::hil {
namespace {

constexpr std::size_t kUnexposedKept = 64;

}  // namespace

void Replayer::State::send_frames() {
  if (faults.has(FaultKind::kCpuLoad)) prefer_this_thread();
  std::vector<std::uint8_t> memory;
  while (auto job = jobs.pop(Duration::from_seconds(3600))) {
    FlightFrame frame;
    if (auto read = pixels.frame(job->number, memory, frame); !read.ok()) {
      sender_error = read.error().message();
      sender_failed = true;
      return;
    }
    const ImageView picture = camera_faults.picture(frame.image, job->light);
    const Duration held = camera_faults.delay();
    if (held.ns > 0) sleep_until_ns(monotonic_ns() + held.ns);
    job->sent.host_ns = monotonic_ns();
    const SendReport report = device->send({job->sent.block_id, job->sent.tick_ns, picture}, job->due_ns);
    job->sent.sent = report.sent;
    sent_log.add(job->sent);
    if (!report.sent) ++frames_unsent;
    else ++frames_sent;
    if (report.late.ns > max_late_ns) max_late_ns = report.late.ns;
    if (report.late > options.late_after) ++late;
  }
}

void Replayer::State::fault_changed(const Fault& fault, bool on) {
  const GigeSettings now = device->settings();
  switch (fault.kind) {
    case FaultKind::kCameraVanish:
      faults.note(fault, on ? 1 : 0);
      if (on) return device->vanish(fault.choice == 0 ? Outage::kPower : Outage::kCable);
      if (auto back = device->reappear(); !back.ok()) fault_error = back.error().message();
      return;
    case FaultKind::kExposure:  // what the service has put right meanwhile stays right
      faults.note(fault, on ? 1 : 0);
      if (on) device->change_settings(rig.device.exposure_us * fault.amount, {});
      else if (now.exposure_us != rig.device.exposure_us) device->change_settings(rig.device.exposure_us, {});
      return;
    case FaultKind::kFrameRate:
      faults.note(fault, on ? 1 : 0);
      if (on) device->change_settings({}, rig.device.frame_rate_hz / std::floor(fault.amount));
      else if (now.frame_rate_hz != rig.device.frame_rate_hz) device->change_settings({}, rig.device.frame_rate_hz);
      return;
    default: break;
  }
  if (!on) return host_faults->end(fault);
  if (auto begun = host_faults->begin(fault); !begun.ok()) fault_error = begun.error().message();
}

int Replayer::State::thinning() const {
  if (!faults.has(FaultKind::kFrameRate)) return 1;
  return std::max(1, static_cast<int>(std::lround(rig.device.frame_rate_hz / device->settings().frame_rate_hz)));
}

double Replayer::State::exposure_factor() const {
  if (!faults.has(FaultKind::kExposure)) return 1;
  const double factor = device->settings().exposure_us / rig.device.exposure_us;
  return std::abs(factor - 1) < 1e-6 ? 1 : factor;
}

/// Does the camera take the picture whose strobe comes now?
bool Replayer::State::exposes() {
  if (!device->streaming()) return false;
  const int every = thinning();
  return every == 1 || ++exposures % every == 0;
}

void Replayer::State::after(Duration delay, std::function<void()> send) {
  if (delay.ns <= 0) return send();
  later.emplace(last_arrival_ns + delay.ns, std::move(send));
}

void Replayer::State::edge(const record::LogEvent& e) {
  const auto decoded = decode_strobe_edge(e.data.data(), e.data.size());
  if (!decoded.ok() || !has_strobe()) return;
  const bool pps = decoded->line != StrobeLine::kStrobe;
  if (!pps && !exposes()) {  // a camera that does not expose has no strobe
    unexposed.push_back(decoded->edge.t + Duration{shift_ns});
    if (unexposed.size() > kUnexposedKept) unexposed.pop_front();
    return;
  }
  StrobeEdge out = decoded->edge;
  out.t = out.t + Duration{shift_ns};
  if (shift_ns != 0) out.line_seq = -1;  // after a jump the numbers of the flight say nothing any more
  if (pps) {
    if (strobe) strobe->send(out, static_cast<std::uint32_t>(rig.pps.line));
    return;
  }
  // Another exposure about the same middle begins earlier or later by half the difference.
  out.t = out.t + Duration::from_seconds((1 - exposure_factor()) * rig.device.exposure_us * 0.5e-6);
  input_faults.strobe(out, edges);
  for (const Delayed<StrobeEdge>& d : edges) after(d.later, [this, edge = d.item] { put_edge(edge); });
}

/// A simulated line is stamped by the kernel, now; the socket carries the flight's own stamp.
void Replayer::State::put_edge(const StrobeEdge& out) {
  if (strobe_line) strobe_line->pulse();
  else strobe->send(out, static_cast<std::uint32_t>(rig.strobe.line));
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

/// True for a frame whose strobe was not sent because the camera did not expose then.
bool Replayer::State::not_exposed(const FrameInfo& info) {
  if (unexposed.empty() || info.time_source == TimeSource::kUnknown) return false;
  const Time start = info.t_mid + Duration{shift_ns} - info.exposure / 2 + rig.strobe.delay;
  const Duration half = rig.device.period() / 2;
  return std::any_of(unexposed.begin(), unexposed.end(), [&](Time t) { return Duration{std::llabs((t - start).ns)} < half; });
}

/// After a jump of the flight the camera's clock runs on from where it was.
std::int64_t Replayer::State::camera_tick(std::int64_t tick_ns) {
  if (tick_jumped && last_tick_ns != 0) tick_shift_ns = last_tick_ns + tick_step_ns - tick_ns;
  tick_jumped = false;
  const std::int64_t tick = tick_ns + tick_shift_ns;
  if (last_tick_ns != 0) tick_step_ns = tick - last_tick_ns;
  last_tick_ns = tick;
  return tick;
}

Result<> Replayer::State::frame(const record::LogEvent& e) {
  const auto index = decode_frame_index(e.data.data(), e.data.size());
  if (!index.ok()) return index.error();
  const std::uint64_t id = index->info.camera_frame_id;
  const std::int64_t tick = camera_tick(index->info.camera_tick_ns);
  if (not_exposed(index->info)) {
    ++frames_unexposed;
    if (thinning() > 1) ++id_base;                    // the camera numbers what it takes
    return Ok{};
  }
  if (acquisition_seen != acquisitions.load()) {
    acquisition_seen = acquisitions.load();
    id_known = false;
  }
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
  const double light = exposure_factor();
  const std::int64_t moved = static_cast<std::int64_t>((1 - light) * rig.device.exposure_us * 500);
  FrameJob job;
  job.number = index->recorded_at;
  job.light = light;
  job.sent = {last_block, input_faults.camera_tick(tick + moved), static_cast<std::int64_t>(id), shift_ns, acquisition_seen, false, 0};
  while (!jobs.try_push(FrameJob(job))) {  // the sender is behind: wait, do not skip
    if (sender_failed) return make_error(ErrorCode::kIo, options.flight, sender_error);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  ++handed;
  if (speed <= 0 || options.answered) wait_answer();
  const std::lock_guard lock(control.mutex);
  if (control.steps > 0 && --control.steps == 0) control.paused = true;
  return Ok{};
}

/// In the record the camera began anew; here its stream goes on, and so do its numbers.
void Replayer::State::acquisition(const record::LogEvent& e) {
  const auto a = decode_acquisition(e.data.data(), e.data.size());
  if (a.ok() && a->what == AcquisitionChange::kStarted && id_known) jumped = true;
}

void Replayer::State::publish(const std::string& name, const std::vector<std::uint8_t>& bytes) {
  ChannelCount& count = channels[name];
  ++(lcm_publish(lcm, name.c_str(), bytes.data(), static_cast<unsigned>(bytes.size())) == 0 ? count.sent : count.failed);
  if (!faults.has(FaultKind::kFlood)) return;
  const std::lock_guard lock(latest_mutex);
  latest[name] = bytes;
}

template <class Message>
void Replayer::State::publish_message(const std::string& name, const Message& m) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  publish(name, bytes);
}

/// A message that does not decode goes on as it is: what it is worth is the service's to say.
void Replayer::State::tspi(const record::LogEvent& e) {
  tspi_t m{};
  if (m.decode(e.data.data(), 0, static_cast<int>(e.data.size())) < 0) return publish(e.channel, e.data);
  m.gps_time_ns += shift_ns;
  input_faults.tspi(e.channel == channel::kTspiReceiver ? Aircraft::kReceiver : Aircraft::kTanker, m, reports);
  for (const Delayed<tspi_t>& d : reports) after(d.later, [this, name = e.channel, report = d.item] { publish_message(name, report); });
}

void Replayer::State::mark(const record::LogEvent& e) {
  time_mark_t m{};
  if (m.decode(e.data.data(), 0, static_cast<int>(e.data.size())) < 0) return publish(e.channel, e.data);
  m.gps_time_ns += shift_ns;
  m.service_time_ns = strobe_line ? due(m.service_time_ns) : m.service_time_ns + shift_ns;
  const auto kept = input_faults.mark(m);
  if (!kept) return;
  if (pps_line) pps_line->pulse();
  publish_message(e.channel, *kept);
}

Result<> Replayer::State::handle(const record::LogEvent& e) {
  if (e.channel == channel::kStrobe) edge(e);
  else if (e.channel == channel::kFrame) return frame(e);
  else if (e.channel == channel::kAcquisition) acquisition(e);
  else if (e.channel == channel::kTspiReceiver || e.channel == channel::kTspiTanker) ++channels[e.channel].offered, tspi(e);
  else if (e.channel == channel::kTimeMark) ++channels[e.channel].offered, mark(e);
  return Ok{};
}

}  // namespace cyclops::hil
