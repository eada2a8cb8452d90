#include "monitor/alarms.hpp"

#include <cmath>
#include <cstdio>

namespace cyclops {
namespace {

bool beyond(const Limit& l, double v) { return l.above ? v > l.limit : v < l.limit; }
/// Neither beyond nor within is the hysteresis: nothing changes there.
bool within(const Limit& l, double v) { return std::isnan(v) || (l.above ? v <= l.clear : v >= l.clear); }

}  // namespace

std::string words(const Limit& limit, double value) {
  char text[220];
  const char* unit = limit.quantity->unit;
  const char* space = *unit != 0 ? " " : "";
  std::snprintf(text, sizeof text, "%s: %s %.4g%s%s, limit %.4g%s%s", limit.text.c_str(), limit.quantity->name, value, space, unit, limit.limit, space, unit);
  return text;
}

Alarms::Alarms(Limits limits) : limits_(std::move(limits)), states_(limits_.items.size()) { changes_.reserve(states_.size()); }

const std::vector<AlarmChange>& Alarms::step(const health_t& h, Time now) {
  changes_.clear();
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const Limit& limit = limits_.items[i];
    State& s = states_[i];
    s.value = limit.quantity->of(h);
    if (!(s.on ? within(limit, s.value) : beyond(limit, s.value))) {
      s.turning = false;
      continue;
    }
    if (!s.turning) s.turned = now;
    s.turning = true;
    if (now - s.turned < (s.on ? limit.clear_hold : limit.hold)) continue;
    s.on = !s.on;
    s.turning = false;
    if (s.on) s.since = s.turned;
    changes_.push_back({&limit, s.on, s.value, s.turned});
  }
  return changes_;
}

void Alarms::put(health_t& out) const {
  out.alarms.clear();
  out.alarm_line.clear();
  for (const AlarmLevel level : {AlarmLevel::kFault, AlarmLevel::kWarning})
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const Limit& limit = limits_.items[i];
      const State& s = states_[i];
      if (!s.on || limit.level != level) continue;
      alarm_t a;
      a.name = limit.name;
      a.level = static_cast<std::int8_t>(limit.level);
      a.text = limit.text;
      a.quantity = limit.quantity->name;
      a.unit = limit.quantity->unit;
      a.value = static_cast<float>(s.value);
      a.limit = static_cast<float>(limit.limit);
      a.since_ns = s.since.ns;
      out.alarm_line += (out.alarm_line.empty() ? "" : "; ") + limit.text;
      out.alarms.push_back(std::move(a));
    }
  out.n_alarms = static_cast<std::int32_t>(out.alarms.size());
}

}  // namespace cyclops
