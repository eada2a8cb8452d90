#include "hil/fault_inputs.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace cyclops::hil {
namespace {

constexpr double kEarthRadius_m = 6'371'000;  // good to half a percent, which is enough for a wrong position

/// Steps while they are on, drifts for ever after.
Duration clock_error(const FaultPlayer& player, FaultKind step_ms, FaultKind drift_ppm) {
  return Duration::from_ms(player.sum(step_ms)) + Duration::from_seconds(1e-6 * player.integral(drift_ppm));
}

}  // namespace

void InputFaults::strobe(const StrobeEdge& edge, std::vector<Delayed<StrobeEdge>>& out) {
  out.clear();
  spurious(edge, out);
  line(edge, out);
  last_edge_ = out.empty() ? edge.t : out.back().item.t;
}

/// What the line makes of the edge itself.
void InputFaults::line(const StrobeEdge& edge, std::vector<Delayed<StrobeEdge>>& out) {
  constexpr int kBuffer = 1;
  StrobeEdge e = edge;
  if (e.line_seq >= 0) e.line_seq += extra_edges_;
  if (player_.strike(FaultKind::kStrobeStuck) != nullptr) { --extra_edges_; return; }
  if (const Fault* f = player_.strike(FaultKind::kStrobeLost); f != nullptr) {
    if (f->choice != kBuffer) --extra_edges_;  // lost before it was numbered
    return;
  }
  if (const Fault* f = player_.strike(FaultKind::kStrobeLate); f != nullptr) e.t = e.t + Duration::from_seconds(1e-6 * f->amount);
  const Fault* held = player_.strike(FaultKind::kStrobeHeld);
  const Duration later = held != nullptr ? Duration::from_ms(held->amount) : Duration{};
  out.push_back({e, later});
  if (const Fault* f = player_.strike(FaultKind::kStrobeDoubled); f != nullptr) {
    ++extra_edges_;
    out.push_back({{e.t + Duration::from_seconds(1e-6 * f->amount), e.line_seq < 0 ? -1 : e.line_seq + 1, e.rising}, later});
  }
}

/// At any moment since the edge before.
void InputFaults::spurious(const StrobeEdge& edge, std::vector<Delayed<StrobeEdge>>& out) {
  const Fault* f = player_.on(FaultKind::kStrobeSpurious);
  if (f == nullptr || last_edge_.ns == 0 || edge.t <= last_edge_) return;
  Time t = last_edge_;
  for (;;) {
    t = t + Duration::from_seconds(-std::log(1 - player_.chance(*f)) / f->amount);
    if (t >= edge.t) return;
    player_.note(*f);
    out.push_back({{t, edge.line_seq < 0 ? -1 : edge.line_seq + extra_edges_++, edge.rising}, {}});
  }
}

std::int64_t InputFaults::camera_tick(std::int64_t tick_ns) {
  const Duration off = clock_error(player_, FaultKind::kCameraClockStep, FaultKind::kCameraClockDrift);
  if (off.ns != 0)
    for (FaultKind kind : {FaultKind::kCameraClockStep, FaultKind::kCameraClockDrift}) (void)player_.strike(kind);
  return tick_ns + off.ns;
}

std::optional<time_mark_t> InputFaults::mark(const time_mark_t& message) {
  if (player_.strike(FaultKind::kPpsLoss) != nullptr) return std::nullopt;
  time_mark_t m = message;
  const Duration off = clock_error(player_, FaultKind::kGpsStep, FaultKind::kGpsDrift);
  m.service_time_ns += off.ns;
  if (off.ns != 0)
    for (FaultKind kind : {FaultKind::kGpsStep, FaultKind::kGpsDrift}) (void)player_.strike(kind);
  return m;
}

void InputFaults::tspi(Aircraft aircraft, const tspi_t& message, std::vector<Delayed<tspi_t>>& out) {
  out.clear();
  if (player_.strike(FaultKind::kTspiLoss, aircraft) != nullptr) return;
  Delayed<tspi_t> d{message, {}};
  corrupt(aircraft, d.item);
  if (const Fault* f = player_.strike(FaultKind::kTspiDelay, aircraft); f != nullptr) d.later = d.later + Duration::from_ms(f->amount);
  if (const Fault* f = player_.strike(FaultKind::kTspiDisorder, aircraft); f != nullptr) d.later = d.later + Duration::from_ms(f->amount * player_.chance(*f));
  out.push_back(d);
  if (player_.strike(FaultKind::kTspiDuplicate, aircraft) != nullptr) out.push_back(d);
}

void InputFaults::corrupt(Aircraft aircraft, tspi_t& m) {
  std::optional<tspi_t>& frozen = frozen_[static_cast<std::size_t>(aircraft)];
  if (player_.strike(FaultKind::kTspiFreeze, aircraft) != nullptr) {  // the link lives, the state does not
    if (!frozen) frozen = m;
    tspi_t still = *frozen;
    still.gps_time_ns = m.gps_time_ns;
    still.seq = m.seq;
    m = still;
  } else {
    frozen.reset();
  }
  if (const Fault* f = player_.strike(FaultKind::kTspiBias, aircraft); f != nullptr)
    m.longitude_deg += f->amount / (kEarthRadius_m * std::cos(m.latitude_deg * std::numbers::pi / 180)) * 180 / std::numbers::pi;
  if (const Fault* f = player_.strike(FaultKind::kTspiNan, aircraft); f != nullptr) {
    double* fields[] = {&m.latitude_deg, &m.height_m, &m.velocity_ned_mps[1], &m.q_n_b[0], &m.rate_b_rps[2], &m.position_sigma_m[0]};
    *fields[static_cast<std::size_t>(player_.chance(*f) * 6)] = std::numeric_limits<double>::quiet_NaN();
  }
  if (player_.strike(FaultKind::kTspiWrongAircraft, aircraft) != nullptr) m.aircraft = static_cast<std::int8_t>(1 - m.aircraft);
}

}  // namespace cyclops::hil
