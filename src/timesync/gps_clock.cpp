#include "timesync/gps_clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace cyclops {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

double as_double(Duration d) { return static_cast<double>(d.ns); }

}  // namespace

Result<GpsClockConfig> GpsClockConfig::read(ConfigTable& time) {
  GpsClockConfig c;
  int from = 0;
  time.read_choice("gps_from", {"time_mark", "arrival", "pps"}, from);
  c.use_arrival = from == 1;
  c.use_pps = from == 2;
  return c;
}

// --- the mapping -------------------------------------------------------------------------------------------------

template <class Begins>
const GpsClock::Ruling& GpsClock::ruling(Begins begins) const {
  std::uint64_t i = history_.end_index() - 1;
  while (i > history_.begin_index() && !begins(history_[i].line)) --i;
  return history_[i];
}

Time GpsClock::to_service(GpsTime t) const {
  CYCLOPS_ASSERT(valid());
  if (source_ == GpsSource::kArrival) return {t.ns + arrival_offset_.ns};
  return ruling([&](const ClockFilter& f) { return f.newest_other() + config_.mark_delay.ns <= t.ns; }).line.at(t.ns);
}

GpsTime GpsClock::to_gps(Time t) const {
  CYCLOPS_ASSERT(valid());
  if (source_ == GpsSource::kArrival) return {t.ns - arrival_offset_.ns};
  const ClockFilter& line = ruling([&](const ClockFilter& f) { return f.newest_service() + config_.mark_delay <= t; }).line;
  const std::int64_t since = (t - line.newest_service()).ns;
  return {line.newest_other() + since - std::llround((line.offset_ns() + line.rate() * static_cast<double>(since)) / (1 + line.rate()))};
}

Duration GpsClock::sigma_at(Time t) const {
  CYCLOPS_ASSERT(valid());
  if (source_ == GpsSource::kArrival) return config_.arrival_sigma;
  const Ruling& r = ruling([&](const ClockFilter& f) { return f.newest_service() + config_.mark_delay <= t; });
  const Duration line = r.line.sigma_at(r.line.newest_other() + (t - r.line.newest_service()).ns);
  return {std::llround(std::hypot(as_double(line), as_double(r.mark_sigma)))};
}

Duration GpsClock::age_at(Time t) const {
  if (source_ != GpsSource::kTimeMark) return {};
  return std::max(t - line_.newest_service(), Duration{});
}

Duration GpsClock::offset() const {
  if (source_ != GpsSource::kTimeMark) return arrival_offset_;
  return {line_.newest_service().ns - line_.newest_other() + std::llround(line_.offset_ns())};
}

// --- marks -------------------------------------------------------------------------------------------------------

Duration GpsClock::off_by(const TimeMark& mark) const { return mark.t - line_.at(mark.t_gps.ns); }

bool GpsClock::agrees(const TimeMark& mark) const {
  if (mark.t_gps.ns <= line_.newest_other()) return false;
  const double sigma = std::hypot(as_double(line_.sigma_at(mark.t_gps.ns)), line_.stamp_sigma_ns(), as_double(mark.sigma));
  return std::abs(as_double(off_by(mark))) <= std::max(config_.gate_sigma * sigma, as_double(config_.gate_floor));
}

bool GpsClock::like_rival(Duration offset, Duration sigma) const {
  const double both = std::hypot(as_double(sigma), as_double(rival_sigma_));
  return std::abs(as_double(offset - rival_)) <= std::max(config_.gate_sigma * both, as_double(config_.gate_floor));
}

void GpsClock::follow(const TimeMark& mark) {
  line_.add(mark.t_gps.ns, mark.t, mark.sigma);
  history_.push({line_, mark.sigma});
  rivals_ = 0;
}

void GpsClock::lock(const TimeMark& mark) {
  line_.forget_offset();
  history_.clear();
  source_ = GpsSource::kTimeMark;
  follow(mark);
}

bool GpsClock::on_mark(const TimeMark& mark) {
  ++counters_.marks;
  if (mark.sigma.ns <= 0) { ++counters_.refused; return false; }
  if (source_ != GpsSource::kTimeMark) {
    first_ = mark;
    lock(mark);
    return true;
  }
  if (agrees(mark)) { follow(mark); return false; }
  ++counters_.contradictions;
  const Duration offset{mark.t.ns - mark.t_gps.ns}, off = off_by(mark);
  if (rivals_ == 0 || !like_rival(offset, mark.sigma)) { rivals_ = 0; rival_ = offset; rival_sigma_ = mark.sigma; }
  const std::int64_t seconds = (std::llabs(off.ns) + kSecond_ns / 2) / kSecond_ns;
  const bool whole = seconds > 0 && std::llabs(std::llabs(off.ns) - seconds * kSecond_ns) < 10 * config_.gate_floor.ns;
  if (++rivals_ < (whole ? config_.whole_seconds : config_.contradictions)) return false;
  ++counters_.relocks;
  if (whole) ++counters_.whole_second_steps;
  lock(mark);
  return true;
}

// --- arrivals ----------------------------------------------------------------------------------------------------

// The least of arrival - sent, frozen after some reports so that the mapping does not creep; after that only what cannot be
// (an arrival clearly before the sending), or reports that are all far too late, begin it anew.
bool GpsClock::on_arrival(Time arrival, GpsTime sent) {
  if (!config_.use_arrival || source_ == GpsSource::kTimeMark) return false;
  ++counters_.arrivals;
  const Duration offset{arrival.ns - sent.ns};
  const Duration far = config_.arrival_sigma * 5;
  const bool settled = reports_ >= config_.arrival_reports;
  late_reports_ = valid() && offset > arrival_offset_ + far ? late_reports_ + 1 : 0;
  const bool contradicts = settled && (offset < arrival_offset_ - config_.arrival_sigma || late_reports_ >= config_.arrival_reports);
  if (contradicts) { ++counters_.arrival_relocks; reports_ = late_reports_ = 0; }
  const bool first = reports_ == 0;
  if (reports_ < config_.arrival_reports) ++reports_;
  if (!first && (settled || offset >= arrival_offset_)) return false;
  arrival_offset_ = offset;
  source_ = GpsSource::kArrival;
  return true;
}

}  // namespace cyclops
