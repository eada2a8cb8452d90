#include "wire/tspi_guard.hpp"

#include <algorithm>

namespace cyclops {
namespace {

constexpr std::int64_t kBucket_ns = 1'000'000'000;

bool same_state(const TspiReport& a, const TspiReport& b) {
  return a.latitude_deg == b.latitude_deg && a.longitude_deg == b.longitude_deg && a.height_m == b.height_m &&
         a.velocity_ned_mps == b.velocity_ned_mps && a.q_n_b.coeffs() == b.q_n_b.coeffs() && a.rate_b_rps == b.rate_b_rps;
}

}  // namespace

const char* to_string(TspiVerdict verdict) {
  switch (verdict) {
    case TspiVerdict::kPass: return "pass";
    case TspiVerdict::kWrongAircraft: return "wrong_aircraft";
    case TspiVerdict::kTooMany: return "too_many";
    case TspiVerdict::kFrozen: return "frozen";
  }
  return "unknown";
}

TspiVerdict TspiGuard::check(const TspiReport& report, Time arrival) {
  if (report.aircraft != aircraft_) { ++counters_.wrong_aircraft; return TspiVerdict::kWrongAircraft; }
  if (!within_rate(arrival)) { ++counters_.too_many; return TspiVerdict::kTooMany; }
  count(report);
  const bool stuck = frozen(report);
  last_ = report;
  any_ = true;
  ++(stuck ? counters_.frozen : counters_.passed);
  return stuck ? TspiVerdict::kFrozen : TspiVerdict::kPass;
}

bool TspiGuard::within_rate(Time arrival) {
  if (!filled_) { filled_ = true; t_filled_ = arrival; credit_ns_ = kBucket_ns; }
  if (arrival > t_filled_) {
    credit_ns_ = std::min(kBucket_ns, credit_ns_ + std::min(kBucket_ns, (arrival - t_filled_).ns));
    t_filled_ = arrival;
  }
  const auto price = static_cast<std::int64_t>(1e9 / config_.max_rate_hz);
  if (credit_ns_ < price) return false;
  credit_ns_ -= price;
  return true;
}

bool TspiGuard::frozen(const TspiReport& report) {
  if (!any_ || !same_state(report, last_) || report.velocity_ned_mps.norm() <= 1) { repeats_ = 0; return false; }
  if (report.t_gps > last_.t_gps) ++repeats_;
  return repeats_ > config_.frozen_after;
}

void TspiGuard::count(const TspiReport& report) {
  if (report.degraded) ++counters_.degraded;
  if (!any_) return;
  if (report.t_gps == last_.t_gps) ++counters_.time_repeated;
  if (report.t_gps < last_.t_gps) ++counters_.time_back;
  const auto step = static_cast<std::int32_t>(report.seq - last_.seq);
  if (step > 1) ++counters_.seq_skipped;
  if (step < 1) ++counters_.seq_back;
}

}  // namespace cyclops
