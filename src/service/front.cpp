#include "service/front.hpp"

namespace cyclops {

Front::Front(const FrameStamperConfig& stamper, const GpsClockConfig& gps, const NavConfig& nav, const NavRig& rig)
    : stamper_(stamper), gps_(gps), aligner_(nav, rig) {}

void Front::restart(Time start) {
  stamper_.restart(start);
  move_stamped();
}

void Front::push(const StrobeEdge& edge) {
  stamper_.on_edge(edge);
  move_stamped();
}

bool Front::push(const TimeMark& mark) {
  const bool changed = gps_.on_mark(mark);
  use_early();
  return changed;
}

TspiVerdict Front::push(const TspiReport& report, Time arrival) {
  const TspiVerdict verdict = guard_[static_cast<std::size_t>(report.aircraft)].check(report, Time{report.t_gps.ns});
  if (verdict != TspiVerdict::kPass) return verdict;
  gps_.on_arrival(arrival, report.t_gps);
  if (gps_.valid()) {
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
  if (!gps_.valid()) return;
  for (const TspiReport& report : early_) use(report);
  early_.clear();
}

std::optional<GpsTime> Front::gps_time(Time t) const {
  if (!gps_.valid()) return std::nullopt;
  return gps_.to_gps(t);
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

void Front::use(const TspiReport& report) { aligner_.push(state_from_report(report, gps_.to_service(report.t_gps))); }

void Front::move_stamped() {
  FrameInfo frame;
  FrameToken token = 0;
  while (stamper_.pop(frame, token)) {
    if (frame.time_source == TimeSource::kUnknown) ++counters_.untimed_frames;
    aligner_.push(frame, token);
  }
}

}  // namespace cyclops
