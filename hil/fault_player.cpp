#include "hil/fault_player.hpp"

#include <algorithm>

#include "hil/dice.hpp"

namespace cyclops::hil {

FaultPlayer::FaultPlayer(FaultScript script) : seed_(script.seed) {
  for (Fault& f : script.faults) {
    faults_.push_back(std::make_unique<Live>());
    by_kind_[static_cast<std::size_t>(f.kind)].push_back(faults_.back().get());
    faults_.back()->fault = std::move(f);
  }
}

void FaultPlayer::set(Live& live, bool on, std::int64_t host_ns) {
  live.on = on;
  (on ? live.from_ns : live.until_ns) = host_ns;
  live.over = !on;
  if (on_change_) on_change_(live.fault, on);
}

void FaultPlayer::advance(double flight_s, std::int64_t host_ns) {
  now_s_ = flight_s;
  for (auto& live : faults_) {
    if (live->on && flight_s >= live->fault.end_s()) set(*live, false, host_ns);
    if (!live->on && !live->over && flight_s >= live->fault.onset_s) set(*live, true, host_ns);
  }
}

void FaultPlayer::finish(std::int64_t host_ns) {
  for (auto& live : faults_)
    if (live->on) set(*live, false, host_ns);
}

bool FaultPlayer::has(FaultKind kind) const { return !of(kind).empty(); }

const Fault* FaultPlayer::on(FaultKind kind) const {
  for (const Live* live : of(kind))
    if (live->on) return &live->fault;
  return nullptr;
}

template <class Fits>
const Fault* FaultPlayer::strike_if(FaultKind kind, Fits fits) {
  for (Live* live : of(kind)) {
    if (!live->on || !fits(live->fault)) continue;
    if (live->fault.share < 1 && chance(live->fault) >= live->fault.share) continue;
    ++live->struck;
    return &live->fault;
  }
  return nullptr;
}

const Fault* FaultPlayer::strike(FaultKind kind) {
  return strike_if(kind, [](const Fault&) { return true; });
}

const Fault* FaultPlayer::strike(FaultKind kind, Aircraft aircraft) {
  constexpr int kBoth = 2;
  return strike_if(kind, [&](const Fault& f) { return f.choice == kBoth || f.choice == static_cast<int>(aircraft); });
}

std::size_t FaultPlayer::index(const Fault& fault) const {
  const auto found = std::find_if(faults_.begin(), faults_.end(), [&](const auto& live) { return &live->fault == &fault; });
  CYCLOPS_ASSERT(found != faults_.end());
  return static_cast<std::size_t>(found - faults_.begin());
}

void FaultPlayer::note(const Fault& fault, std::uint64_t times) { faults_[index(fault)]->struck += times; }

double FaultPlayer::chance(const Fault& fault) {
  const std::size_t i = index(fault);
  return dice(static_cast<std::uint64_t>(seed_) ^ (static_cast<std::uint64_t>(i + 1) << 40) ^ faults_[i]->drawn++);
}

double FaultPlayer::sum(FaultKind kind) const {
  double total = 0;
  for (const Live* live : of(kind))
    if (live->on) total += live->fault.amount;
  return total;
}

double FaultPlayer::integral(FaultKind kind) const {
  double total = 0;
  for (const Live* live : of(kind)) total += live->fault.amount * std::clamp(now_s_ - live->fault.onset_s, 0.0, live->fault.duration_s);
  return total;
}

nlohmann::json FaultPlayer::report() const {
  nlohmann::json out = nlohmann::json::array();
  for (const auto& live : faults_)
    out.push_back({{"name", live->fault.name},
                   {"kind", name_of(live->fault.kind)},
                   {"text", live->fault.text},
                   {"onset_s", live->fault.onset_s},
                   {"duration_s", live->fault.duration_s},
                   {"struck", live->struck.load()},
                   {"from_ns", live->from_ns},
                   {"until_ns", live->until_ns}});
  return out;
}

}  // namespace cyclops::hil
