#include "timesync/gps_clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace cyclops {

Result<GpsClockConfig> GpsClockConfig::read(ConfigTable& time) {
  GpsClockConfig c;
  int from = 0;
  time.read_choice("gps_from", {"time_mark", "arrival"}, from);
  c.use_arrival = from == 1;
  return c;
}

Time GpsClock::to_service(GpsTime t) const {
  CYCLOPS_ASSERT(valid());
  return {t.ns + offset_.ns};
}

GpsTime GpsClock::to_gps(Time t) const {
  CYCLOPS_ASSERT(valid());
  return {t.ns - offset_.ns};
}

bool GpsClock::agree(Duration a, Duration sigma_a, Duration b, Duration sigma_b) const {
  const double sigma = std::hypot(static_cast<double>(sigma_a.ns), static_cast<double>(sigma_b.ns));
  const double gate = std::max(config_.gate_sigma * sigma, static_cast<double>(config_.gate_floor.ns));
  return std::abs(static_cast<double>((a - b).ns)) <= gate;
}

void GpsClock::lock(Duration offset, Duration sigma, GpsSource source) {
  offset_ = offset;
  sigma_ = lock_sigma_ = sigma;
  source_ = source;
  rivals_ = 0;
}

bool GpsClock::on_mark(const TimeMark& mark) {
  ++counters_.marks;
  if (mark.sigma.ns <= 0) { ++counters_.refused; return false; }
  const Duration offset{mark.t.ns - mark.t_gps.ns};
  if (source_ != GpsSource::kTimeMark) { lock(offset, mark.sigma, GpsSource::kTimeMark); return true; }
  if (agree(offset, mark.sigma, offset_, lock_sigma_)) {
    sigma_ = std::max(lock_sigma_, Duration{std::llabs((offset - offset_).ns)});
    rivals_ = 0;
    return false;
  }
  ++counters_.contradictions;
  if (rivals_ == 0 || !agree(offset, mark.sigma, rival_, rival_sigma_)) { rivals_ = 0; rival_ = offset; rival_sigma_ = mark.sigma; }
  if (++rivals_ < config_.contradictions) return false;
  ++counters_.relocks;
  lock(offset, mark.sigma, GpsSource::kTimeMark);
  return true;
}

// The least of arrival - sent, frozen after some reports so that the mapping does not creep; after that only what cannot be
// (an arrival clearly before the sending), or reports that are all far too late, begin it anew.
bool GpsClock::on_arrival(Time arrival, GpsTime sent) {
  if (!config_.use_arrival || source_ == GpsSource::kTimeMark) return false;
  ++counters_.arrivals;
  const Duration offset{arrival.ns - sent.ns};
  const Duration far = config_.arrival_sigma * 5;
  const bool settled = reports_ >= config_.arrival_reports;
  late_reports_ = valid() && offset > offset_ + far ? late_reports_ + 1 : 0;
  const bool contradicts = settled && (offset < offset_ - config_.arrival_sigma || late_reports_ >= config_.arrival_reports);
  if (contradicts) { ++counters_.arrival_relocks; reports_ = late_reports_ = 0; }
  const bool first = reports_ == 0;
  if (reports_ < config_.arrival_reports) ++reports_;
  if (!first && (settled || offset >= offset_)) return false;
  lock(offset, config_.arrival_sigma, GpsSource::kArrival);
  return true;
}

}  // namespace cyclops
