/// What Associator does with the k best assignments: readings kept over frames, and doubt about single matches.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "associate/associate.hpp"

namespace cyclops {

// --- readings over frames --------------------------------------------------------------------------------------

void Associator::judge_reading(std::size_t reading, std::size_t tracks) {
  claims_.clear();
  for (const Pair& p : pairs_) claims_.push_back({p.corner, p.gain + config_.cardinality_bonus_px});
  const std::size_t n = k_best_.run({first_pair_.data(), tracks + 1}, claims_, static_cast<std::size_t>(config_.best));
  for (std::size_t i = 0; i < n; ++i) hypotheses_.judge(reading, k_best_.total(i), k_best_.corners(i));
  if (n > 0) return;
  ++counters_.too_many;
  rivals_.assign(tracks, -1);
  double total = 0;
  assign(tracks, corners_);
  for (const Pair& p : pairs_)
    if (auction_.owner(static_cast<std::size_t>(p.track)) == p.corner) {
      rivals_[static_cast<std::size_t>(p.track)] = p.corner;
      total += p.gain;
    }
  hypotheses_.judge(reading, total, rivals_);
}

void Associator::associate_readings(const TrackSet& tracks, const CornerSet& corners, MatchSet& out) {
  corners_ = corners.items.size();
  const std::size_t n = hypotheses_.begin(tracks, corners.t_mid);
  for (std::size_t i = 0; i < n; ++i) {
    hypotheses_.expected(i, tracks, expected_);
    gather(expected_, corners, out);
    judge_reading(i, tracks.size());
  }
  const std::span<const std::int32_t> best = hypotheses_.settle(corners);
  hypotheses_.expected(hypotheses_.best(), tracks, expected_);
  gather(expected_, corners, out);
  for (const Pair& p : pairs_)
    if (best[static_cast<std::size_t>(p.track)] == p.corner) give(p, out);
}

// --- doubt about single matches --------------------------------------------------------------------------------

std::int32_t Associator::rival_root(std::int32_t track) {
  while (rival_[static_cast<std::size_t>(track)] != track) track = rival_[static_cast<std::size_t>(track)];
  return track;
}

/// Tracks that want the same corner compete, and those that compete with them.
void Associator::find_rivals(std::size_t tracks) {
  rival_.resize(tracks);
  std::iota(rival_.begin(), rival_.end(), 0);
  for (const Pair& p : pairs_) {
    std::int32_t& claimant = claimant_[static_cast<std::size_t>(p.corner)];
    if (claimant >= 0) {
      const std::int32_t a = rival_root(claimant), b = rival_root(p.track);
      rival_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
    claimant = p.track;
  }
  for (const Pair& p : pairs_) claimant_[static_cast<std::size_t>(p.corner)] = -1;
  for (std::int32_t& r : rival_) r = rival_[static_cast<std::size_t>(r)];  // all point at their root: roots come first
}

void Associator::doubt(const CornerSet& corners, MatchSet& out) {
  find_rivals(out.size());
  for (std::size_t root = 0; root < out.size(); ++root) {
    if (rival_[root] != static_cast<std::int32_t>(root)) continue;
    rivals_.clear();
    for (std::size_t i = root; i < out.size(); ++i)
      if (rival_[i] == static_cast<std::int32_t>(root)) rivals_.push_back(static_cast<std::int32_t>(i));
    doubt_rivals(corners, out);
  }
}

void Associator::doubt_rivals(const CornerSet& corners, MatchSet& out) {
  claims_.clear();
  first_claim_.assign(1, 0);
  for (const std::int32_t track : rivals_) {
    const auto t = static_cast<std::size_t>(track);
    for (std::uint32_t k = first_pair_[t]; k < first_pair_[t + 1]; ++k) claims_.push_back({pairs_[k].corner, pairs_[k].gain});
    first_claim_.push_back(static_cast<std::uint32_t>(claims_.size()));
  }
  if (claims_.size() < 2) return;  // nothing else could be
  const std::size_t n = k_best_.run(first_claim_, claims_, static_cast<std::size_t>(config_.best));
  if (n == 0) ++counters_.too_many;
  for (std::size_t r = 0; n > 0 && r < rivals_.size(); ++r) {
    Match& match = out[static_cast<std::size_t>(rivals_[r])];
    if (match.corner < 0 || probability(r, match.corner, n, corners) >= config_.min_probability) continue;
    ++counters_.ambiguous;
    match.corner = -1;
    match.reason = MatchReason::kAmbiguous;
    match.gain_px = 0;
  }
}

/// Share of the solutions in which the track has this corner, or one at the same place, among those in which another has the corner or it has.
double Associator::probability(std::size_t rival, std::int32_t corner, std::size_t solutions, const CornerSet& corners) const {
  const Vec2& place = corners.items[static_cast<std::size_t>(corner)].uv_px;
  double mine = 0, others = 0;
  for (std::size_t s = 0; s < solutions; ++s) {
    const auto taken = k_best_.corners(s);
    const double weight = std::exp(k_best_.total(s) - k_best_.total(0));
    const bool here = taken[rival] >= 0 && (corners.items[static_cast<std::size_t>(taken[rival])].uv_px - place).squaredNorm() <= kSame_px * kSame_px;
    if (here) mine += weight;
    else if (std::find(taken.begin(), taken.end(), corner) != taken.end()) others += weight;
  }
  return mine + others > 0 ? mine / (mine + others) : 1;
}

}  // namespace cyclops
