#include "timesync/lock_search.hpp"

#include <algorithm>
#include <cstdlib>

namespace cyclops {
namespace {

Duration since_exposure_end(const LockFrame& f, Time edge, const LockGates& g) {
  return f.arrival - (edge - g.edge_delay) - f.exposure;
}

constexpr std::uint64_t kNoEdge = ~std::uint64_t{0};

// Edges after `not_after` may or may not have been seen yet: they must not count.
std::uint64_t nearest_edge(const EdgeRing& edges, Time expected, Duration within, Time not_after) {
  std::uint64_t best = kNoEdge;
  std::int64_t best_off = within.ns + 1;
  for (std::uint64_t i = edges.begin_index(); i < edges.end_index() && edges[i].t <= not_after; ++i) {
    const std::int64_t off = std::llabs((edges[i].t - expected).ns);
    if (off < best_off) { best_off = off; best = i; }
  }
  return best;
}

// Can the offset be true: every frame has an edge, and none came too early? (That one came promptly is how the offset was found.)
bool examine(std::span<const LockFrame> frames, const EdgeRing& edges, const LockGates& g, LockCandidate& c) {
  for (std::size_t j = 0; j < frames.size(); ++j) {
    const Time expected{frames[j].tick_ns + c.edge_minus_tick.ns};
    if (since_exposure_end(frames[j], expected, g) < -g.slack) return false;
    c.edge[j] = nearest_edge(edges, expected, g.residual, frames.back().arrival);
    if (c.edge[j] == kNoEdge) return false;
    c.misfit = c.misfit + Duration{std::llabs((edges[c.edge[j]].t - expected).ns)};
  }
  return true;
}

void keep(LockCandidates& out, const LockCandidate& c, Duration period, Duration residual) {
  for (LockCandidate& known : out) {
    const Duration apart{std::llabs((known.edge_minus_tick - c.edge_minus_tick).ns)};
    if (apart.ns >= period.ns / 8) continue;
    if (apart <= residual ? c.misfit < known.misfit : c.edge_minus_tick < known.edge_minus_tick) known = c;
    return;
  }
  (void)out.try_push_back(c);   // more than eight offsets are as ambiguous as eight
}

}  // namespace

Duration quiet_period(std::span<const LockFrame> frames, double quiet, Duration residual) {
  const LockFrame &first = frames.front(), &last = frames.back();
  if (last.number <= first.number || last.tick_ns <= first.tick_ns) return {};
  const Duration period{(last.tick_ns - first.tick_ns) / static_cast<std::int64_t>(last.number - first.number)};
  std::int64_t low = INT64_MAX, high = INT64_MIN;
  for (std::size_t j = 0; j < frames.size(); ++j) {
    if (j > 0 && frames[j].number <= frames[j - 1].number) return {};
    const std::int64_t steps = static_cast<std::int64_t>(frames[j].number - first.number);
    if (std::llabs(frames[j].tick_ns - first.tick_ns - steps * period.ns) > residual.ns) return {};
    const std::int64_t transport = (frames[j].arrival - first.arrival).ns - (frames[j].tick_ns - first.tick_ns);
    low = std::min(low, transport);
    high = std::max(high, transport);
  }
  return static_cast<double>(high - low) <= quiet * static_cast<double>(period.ns) ? period : Duration{};
}

void find_locks(std::span<const LockFrame> frames, const EdgeRing& edges, Duration period, const LockGates& gates, LockCandidates& out) {
  out.clear();
  for (const LockFrame& anchor : frames) {
    for (std::uint64_t i = edges.begin_index(); i < edges.end_index() && edges[i].t <= frames.back().arrival; ++i) {
      const Duration after = since_exposure_end(anchor, edges[i].t, gates);
      if (after < -gates.slack || after > gates.transport_max) continue;
      LockCandidate c;
      c.edge_minus_tick = Duration{edges[i].t.ns - anchor.tick_ns};
      if (examine(frames, edges, gates, c)) keep(out, c, period, gates.residual);
    }
  }
}

}  // namespace cyclops
