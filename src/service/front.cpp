#include "service/front.hpp"

namespace cyclops {

namespace {

GpsClockConfig rough(GpsClockConfig config) {
  config.use_arrival = true;
  return config;
}

}  // namespace

Front::Front(const FrameStamperConfig& stamper, const GpsClockConfig& gps, const NavConfig& nav, const NavRig& rig, const PpsConfig& pps)
    : stamper_(stamper), by_pps_(gps.use_pps), gps_(gps), rough_(rough(gps)), pps_(pps), aligner_(nav, rig) {}

void Front::restart(Time start) {
  stamper_.restart(start);
  move_stamped();
}

void Front::push(const StrobeEdge& edge) {
  stamper_.on_edge(edge);
  move_stamped();
}

bool Front::push(const TimeMark& mark) {
  const bool changed = (by_pps_ ? rough_ : gps_).on_mark(mark);
  use_early();
  return changed && !(by_pps_ && gps_.valid());
}

bool Front::push(const PpsEdge& edge) {
  if (!by_pps_) return false;
  const std::optional<TimeMark> mark = pps_.on_edge(edge.edge, gps_time(edge.edge.t));
  if (!mark) return false;
  const bool changed = gps_.on_mark(*mark);
  use_early();
  return changed;
}

TspiVerdict Front::push(const TspiReport& report, Time arrival) {
  const TspiVerdict verdict = guard_[static_cast<std::size_t>(report.aircraft)].check(report, Time{report.t_gps.ns});
  if (verdict != TspiVerdict::kPass) return verdict;
  (by_pps_ ? rough_ : gps_).on_arrival(arrival, report.t_gps);
  if (gps().valid()) {
    use_early();
    use(report);
  } else if (early_.try_push_back(report)) {
    ++counters_.tspi_before_clock;
  } else {
    ++counters_.tspi_without_clock;
  }
  return verdict;
}

void Front::use_early() {
  if (!gps().valid()) return;
  for (const TspiReport& report : early_) use(report);
  early_.clear();
}

std::optional<GpsTime> Front::gps_time(Time t) const {
  if (!gps().valid()) return std::nullopt;
  return clock_at(t).to_gps(t);
}

ClockState Front::clocks() const {
  ClockState c;
  c.t = newest_;
  const GpsClock& clock = clock_at(newest_);
  c.gps_source = clock.source();
  if (clock.valid()) {
    c.gps_offset = clock.offset();
    c.gps_sigma = newest_.ns != 0 ? clock.sigma_at(newest_) : Duration{};
    c.gps_age = newest_.ns != 0 ? clock.age_at(newest_) : Duration{};
    c.gps_drift_ppm = clock.drift_ppm();
    c.gps_drift_sigma_ppm = clock.drift_sigma_ppm();
  }
  const TickLine& line = stamper_.line();
  c.strobe_locked = stamper_.locked();
  c.camera_drift_ppm = line.rate_ppm();
  c.camera_drift_sigma_ppm = line.rate_sigma_ppm();
  c.edge_scatter_us = line.rms_ns() * 1e-3;
  if (line.valid()) {
    c.camera_sigma = line.sigma_at(stamper_.newest_tick_ns());
    c.camera_age = line.age_at(stamper_.newest_tick_ns());
  }
  return c;
}

bool Front::push(const FrameInfo& frame, std::uint64_t token) {
  if (!stamper_.on_frame(frame, token)) return false;
  ++in_;
  move_stamped();
  return true;
}

void Front::flush() {
  stamper_.flush();
  move_stamped();
  aligner_.flush();
}

bool Front::pop(AlignedFrame& out) {
  if (!aligner_.pop(out)) return false;
  ++out_;
  return true;
}

std::size_t Front::waiting() const { return static_cast<std::size_t>(in_ - out_); }

void Front::use(const TspiReport& report) { aligner_.push(state_from_report(report, clock_at(report.t_gps).to_service(report.t_gps))); }

void Front::move_stamped() {
  FrameInfo frame;
  FrameToken token = 0;
  while (stamper_.pop(frame, token)) {
    if (frame.time_source == TimeSource::kUnknown) ++counters_.untimed_frames;
    else newest_ = frame.t_mid;
    aligner_.push(frame, token);
  }
}

}  // namespace cyclops
