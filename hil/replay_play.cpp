// Keeping time: when the next event of the flight is due, and what a person wants meanwhile.
#include <chrono>

#include "hil/replay_state.hpp"
#include "wire/channels.hpp"

namespace cyclops::hil {
namespace {

constexpr std::int64_t kCatchUp_ns = 50'000'000;
constexpr std::int64_t kTail_ns = 20'000'000;  // after the last exposure: its frame has arrived; a loop waits for nothing else

}  // namespace

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

/// From here on the flight goes on at another place: its next exposure follows the last one after one period, and the messages
/// before it are left out.
Result<bool> Replayer::State::jump(record::LogEvent& e) {
  const char* const wanted = has_strobe() ? channel::kStrobe : channel::kFrame;
  for (;;) {
    auto more = flight.next(e);
    if (!more.ok() || !*more) return more;
    if (e.channel == wanted) break;
  }
  const std::int64_t arrival = e.time_us * 1000;
  const std::int64_t period = rig.device.period().ns;
  const std::int64_t next = speed > 0 ? due(last_exposure_ns - shift_ns) + static_cast<std::int64_t>(static_cast<double>(period) / speed) : 0;
  if (last_exposure_ns != 0) shift_ns = last_exposure_ns + period - arrival;
  anchor(arrival);
  if (last_exposure_ns != 0 && next > host0_ns - kCatchUp_ns) host0_ns = next;  // without a pause, unless it is late already
  jumped = tick_jumped = true;
  return true;
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
    return jump(e);
  }
  auto more = flight.next(e);
  const bool after_last = options.loop && more.ok() && *more && e.time_us * 1000 > flight.manifest().last_frame_ns + kTail_ns;
  if (!more.ok() || !options.loop || (*more && !after_last)) return more;
  CYCLOPS_TRY(flight.rewind());
  ++loops;
  return jump(e);
}

/// What a fault has held back and is due before `until_ns`, each at its own time. Shifted arrivals.
void Replayer::State::send_later(std::int64_t until_ns) {
  while (!later.empty() && later.begin()->first <= until_ns) {
    const auto first = later.begin();
    const std::function<void()> send = std::move(first->second);
    const std::int64_t arrival = first->first - shift_ns;
    later.erase(first);
    if (speed > 0) sleep_until_ns(due(arrival));
    send();
  }
}

void Replayer::State::show(const std::function<void(const ReplayProgress&)>& progress, std::int64_t arrival_ns, std::int64_t& next) {
  const std::int64_t now = monotonic_ns();
  if (!progress || now <= next) return;
  next = now + 500'000'000;
  const double wall = static_cast<double>(now - wall0_ns - paused_ns) * 1e-9;
  const FlightManifest& m = flight.manifest();
  progress({static_cast<double>(arrival_ns - m.first_frame_ns) * 1e-9, static_cast<double>(m.last_frame_ns - m.first_frame_ns) * 1e-9, handed,
            wall > 0 ? static_cast<double>(played_ns) * 1e-9 / wall : 0, late, control.paused});
}

Result<> Replayer::State::play(const std::function<void(const ReplayProgress&)>& progress) {
  record::LogEvent event;
  bool first = true;
  std::int64_t next_progress = 0;
  while (true) {
    auto more = next_event(event);
    if (!more.ok()) return more.error();
    if (!*more) break;
    const std::int64_t arrival = event.time_us * 1000;
    if (first) {
      first_arrival_ns = arrival;
      anchor(arrival);
      first = false;
    }
    if (!wait_control(arrival)) break;
    send_later(arrival + shift_ns);
    wait_due(arrival);
    if (!wait_control(arrival)) break;
    faults.advance(static_cast<double>(arrival + shift_ns - first_arrival_ns) * 1e-9, monotonic_ns());
    if (!fault_error.empty()) return make_error(ErrorCode::kIo, "faults", fault_error);
    CYCLOPS_TRY(handle(event));
    last_arrival_ns = arrival + shift_ns;
    if (event.channel == (has_strobe() ? channel::kStrobe : channel::kFrame)) last_exposure_ns = last_arrival_ns;
    played_ns = last_arrival_ns - first_arrival_ns;
    show(progress, arrival, next_progress);
    if (options.most_frames > 0 && handed >= options.most_frames) break;
    if (options.most_s > 0 && static_cast<double>(played_ns) * 1e-9 >= options.most_s) break;
  }
  send_later(INT64_MAX);
  faults.finish(monotonic_ns());
  return Ok{};
}

/// The camera stays for resends of the last frame and until the client has let go of it, or it would wait for answers.
void Replayer::State::wait_for_client_to_leave() const {
  int quiet = 0;
  for (int tenths = 0; tenths < 80 && quiet < 12; ++tenths) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    quiet = device->streaming() ? 0 : quiet + 1;
  }
}

}  // namespace cyclops::hil
