#include "timesync/tick_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cyclops {
namespace {

constexpr std::size_t kPairsForRate = 8;   // below that, or below that span, the rate of before is kept
constexpr double kSpanForRate_ns = 0.25e9;
constexpr double kUnknownRate = 20e-6;
constexpr double kLeastRateSigma = 1e-7;   // temperature moves a quartz by this much within seconds

}  // namespace

void TickLine::clear() {
  clear_pairs();
  rate_ = 0;
  rate_sigma_ = kUnknownRate;
}

void TickLine::clear_pairs() {
  pairs_.clear();
  offset_ns_ = 0;
  rms_ns_ = 0;
}

void TickLine::add(std::int64_t tick_ns, Time edge) {
  pairs_.push({tick_ns, edge});
  refit();
}

// Least squares over the pairs whose residual against `before` is within the limit, relative to the newest pair.
TickLine::Fit TickLine::fit(double limit_ns, const Fit& before) const {
  const Pair& newest = pairs_.back();
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  for (std::uint64_t i = pairs_.begin_index(); i < pairs_.end_index(); ++i) {
    const double x = static_cast<double>(pairs_[i].tick_ns - newest.tick_ns);
    const double y = static_cast<double>((pairs_[i].edge - newest.edge).ns - (pairs_[i].tick_ns - newest.tick_ns));
    if (std::abs(y - before.offset_ns - before.rate * x) > limit_ns) continue;
    n += 1; sx += x; sy += y; sxx += x * x; sxy += x * y; syy += y * y;
  }
  Fit out = before;
  if (n < 1) return out;
  const double vx = sxx - sx * sx / n, vxy = sxy - sx * sy / n;
  const double span = static_cast<double>(newest.tick_ns - pairs_.front().tick_ns);
  if (n >= kPairsForRate && span >= kSpanForRate_ns) out.rate = std::clamp(vxy / vx, -max_rate_, max_rate_);
  out.offset_ns = (sy - out.rate * sx) / n;
  const double squares = syy - sy * sy / n - 2 * out.rate * vxy + out.rate * out.rate * vx;
  out.rms_ns = std::sqrt(std::max(squares, 0.0) / n);
  out.used = static_cast<std::size_t>(n);
  return out;
}

void TickLine::refit() {
  Fit prior;
  prior.rate = rate_;
  const Fit all = fit(std::numeric_limits<double>::infinity(), prior);
  const Fit kept = fit(std::max(3 * all.rms_ns, 1.0), all);
  offset_ns_ = kept.offset_ns;
  rate_ = kept.rate;
  rms_ns_ = kept.rms_ns;
  const double span = static_cast<double>(pairs_.back().tick_ns - pairs_.front().tick_ns);
  if (kept.used >= kPairsForRate && span >= kSpanForRate_ns)
    rate_sigma_ = kLeastRateSigma + rms_ns_ / span * std::sqrt(12.0 / static_cast<double>(kept.used));
}

Time TickLine::at(std::int64_t tick_ns) const {
  const std::int64_t x = tick_ns - pairs_.back().tick_ns;
  return pairs_.back().edge + Duration{x + std::llround(offset_ns_ + rate_ * static_cast<double>(x))};
}

Duration TickLine::sigma_at(std::int64_t tick_ns) const {
  const double drift = rate_sigma_ * static_cast<double>(age_at(tick_ns).ns);
  const double mean2 = rms_ns_ * rms_ns_ / static_cast<double>(pairs_.size());
  return {std::llround(std::sqrt(mean2 + drift * drift))};
}

}  // namespace cyclops
