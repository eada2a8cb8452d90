#include "associate/associate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cyclops {
namespace {

bool takes_part(const Track& track) {
  return (track.state == TrackState::kLive || track.state == TrackState::kCoasting) && track.uv_px.allFinite();
}

double largest_eigenvalue(const Mat2& m) {
  const double half = 0.5 * (m(0, 0) + m(1, 1)), d = 0.5 * (m(0, 0) - m(1, 1));
  return half + std::sqrt(d * d + m(0, 1) * m(1, 0));
}

double largest_variance(const CornerSet& corners) {
  double most = 0;
  for (const Corner& c : corners.items) most = std::fmax(most, largest_eigenvalue(c.cov_px2));
  return most;
}

}  // namespace

Result<AssociateConfig> AssociateConfig::read(ConfigTable& table, AssociateConfig c) {
  table.read_enum("method", {"auction", "k-best"}, c.method);
  table.read_enum("gate", {"fixed", "mahalanobis"}, c.gate);
  table.read_in("gate_px", 1.0, 200.0, c.gate_px);
  table.read_in("epsilon_px", 1e-6, 10.0, c.epsilon_px);
  table.read_in("cardinality_bonus_px", 0.0, 1e6, c.cardinality_bonus_px);
  table.read_in("max_bids", 1, 100000000, c.max_bids);
  table.read_in("chi_square", 0.1, 100.0, c.chi_square);
  table.read_in("max_gate_px", 1.0, 200.0, c.max_gate_px);
  table.read_in("model_sigma_px", 0.0, 50.0, c.model_sigma_px);
  table.read_in("detection_probability", 0.01, 0.999, c.detection_probability);
  table.read_in("clutter_per_px2", 1e-9, 1.0, c.clutter_per_px2);
  table.read_in("min_probability", 0.0, 1.0, c.min_probability);
  table.read_in("best", 1, 64, c.best);
  table.read_in("readings", 1, 64, c.readings);
  table.read_in("reading_memory_s", 0.01, 60.0, c.reading_memory_s);
  return c;
}

Associator::Associator(const AssociateConfig& config)
    : config_(config),
      cells_(kMaxCorners),
      auction_(kMaxFeatures),
      k_best_({kMaxRivals, kMaxWanted, static_cast<std::size_t>(config.best), kMaxCorners}),
      hypotheses_({static_cast<std::size_t>(config.readings), config.reading_memory_s}, kMaxFeatures) {
  gate_.resize(kMaxCorners);
  pairs_.reserve(kMaxFeatures * kMaxPerGate);
  offers_.resize(kMaxFeatures * kMaxPerGate);
  first_.resize(kMaxCorners + 2);
  first_pair_.reserve(kMaxFeatures + 1);
  rival_.reserve(kMaxFeatures);
  claimant_.assign(kMaxCorners, -1);
  rivals_.reserve(kMaxFeatures);
  first_claim_.reserve(kMaxFeatures + 1);
  claims_.reserve(kMaxFeatures * kMaxPerGate);
}

/// Radius around the track outside which no corner can be in its gate.
double Associator::radius_px(const Track& track, double corner_variance, double most_px) const {
  if (config_.gate == Gate::kFixed) return config_.gate_px;
  const double variance = largest_eigenvalue(track.cov_px2) + corner_variance + config_.model_sigma_px * config_.model_sigma_px;
  const double reach = std::sqrt(config_.chi_square * variance);
  return reach < most_px ? reach : most_px;  // also when reach is not a number
}

/// Below 0: not in the gate. Mahalanobis only; the gain of the fixed gate is gate - distance.
double Associator::likelihood_gain(const Track& track, const Corner& corner) const {
  const Vec2 d = corner.uv_px - track.uv_px;
  if (corner.feature >= 0 && corner.feature != track.feature) return -1;
  const double model = corner.kind == PointKind::kCorner ? config_.model_sigma_px * config_.model_sigma_px : 0;
  const double a = track.cov_px2(0, 0) + corner.cov_px2(0, 0) + model, c = track.cov_px2(1, 1) + corner.cov_px2(1, 1) + model;
  const double b = track.cov_px2(0, 1) + corner.cov_px2(0, 1);
  const double det = a * c - b * b;
  const double d2 = (c * d.x() * d.x() - 2 * b * d.x() * d.y() + a * d.y() * d.y()) / det;
  if (!(det > 0) || !(d2 <= config_.chi_square)) return -1;
  const double p = config_.detection_probability;
  return std::log(p / ((1 - p) * config_.clutter_per_px2 * 2 * std::numbers::pi * std::sqrt(det))) - 0.5 * d2;
}

/// Turns the squared distances of the first n of gate_ into gains; returns how many are worth something.
std::size_t Associator::weigh(const Track& track, const CornerSet& corners, double gate_px, std::size_t n) {
  const auto end = gate_.begin() + static_cast<std::ptrdiff_t>(n);
  if (config_.gate == Gate::kFixed) {
    for (auto p = gate_.begin(); p != end; ++p) p->gain = gate_px - std::sqrt(p->gain);
    return n;
  }
  const Corner* all = corners.items.begin();
  for (auto p = gate_.begin(); p != end; ++p) p->gain = likelihood_gain(track, all[p->corner]);
  return static_cast<std::size_t>(std::remove_if(gate_.begin(), end, [](const Pair& p) { return !(p.gain >= 0); }) - gate_.begin());
}

/// Brings the best kMaxPerGate of n candidates to the front; equal gains go by the corner's index.
std::size_t Associator::thin(std::size_t n) {
  if (n <= kMaxPerGate) return n;
  ++counters_.gates_thinned;
  std::nth_element(gate_.begin(), gate_.begin() + (kMaxPerGate - 1), gate_.begin() + static_cast<std::ptrdiff_t>(n), [](const Pair& x, const Pair& y) {
    return x.gain > y.gain || (x.gain == y.gain && x.corner < y.corner);
  });
  return kMaxPerGate;
}

/// True when there is something within gate_px.
bool Associator::gather_one(const Track& track, std::size_t index, const CornerSet& corners, double gate_px, double wide_px) {
  const auto i = static_cast<std::int32_t>(index);
  const double u0 = track.uv_px.x(), v0 = track.uv_px.y(), limit = wide_px * wide_px;
  std::size_t n = 0;  // written always, counted only inside the gate: no branch to mispredict
  cells_.near(track.uv_px, wide_px, [&](std::int32_t corner, double u, double v) {
    const double d2 = (u - u0) * (u - u0) + (v - v0) * (v - v0);
    gate_[n] = {corner, i, d2, d2 > gate_px * gate_px};
    n += d2 <= limit ? 1 : 0;
  });
  n = thin(weigh(track, corners, gate_px, n));
  const auto end = gate_.begin() + static_cast<std::ptrdiff_t>(n);
  pairs_.insert(pairs_.end(), gate_.begin(), end);
  return std::any_of(gate_.begin(), end, [](const Pair& p) { return !p.far; });
}

void Associator::gather(const TrackSet& tracks, const CornerSet& corners, MatchSet& out) {
  const double variance = config_.gate == Gate::kMahalanobis ? largest_variance(corners) : 0;
  cells_.build(corners, config_.gate == Gate::kFixed ? config_.gate_px : config_.max_gate_px);
  pairs_.clear();
  first_pair_.clear();
  out.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    first_pair_.push_back(static_cast<std::uint32_t>(pairs_.size()));
    Match match;
    if (takes_part(tracks[i])) {
      const double gate_px = radius_px(tracks[i], variance, config_.max_gate_px);
      const double wide_px = doubts() ? radius_px(tracks[i], variance, kWide * config_.max_gate_px) : gate_px;
      const bool any = gather_one(tracks[i], i, corners, gate_px, wide_px);
      match.gate_px = static_cast<float>(gate_px);
      match.reason = any ? MatchReason::kLostToOther : MatchReason::kNoCornerInGate;
    } else {
      match.reason = MatchReason::kNotVisible;
    }
    out.push_back(match);
  }
  first_pair_.push_back(static_cast<std::uint32_t>(pairs_.size()));
}

/// A counting sort: the offers of each corner side by side, in the order of the tracks.
void Associator::sort_by_corner(std::size_t corners) {
  std::fill_n(first_.begin(), corners + 2, 0U);
  for (const Pair& p : pairs_) first_[p.corner + 2] += p.far ? 0 : 1;
  for (std::size_t j = 2; j < corners + 2; ++j) first_[j] += first_[j - 1];
  for (const Pair& p : pairs_)
    if (!p.far) offers_[first_[p.corner + 1]++] = {p.track, p.gain + config_.cardinality_bonus_px};
}

void Associator::give(const Pair& pair, MatchSet& out) {
  Match& match = out[static_cast<std::size_t>(pair.track)];
  match.corner = pair.corner;
  match.reason = MatchReason::kMatched;
  match.gain_px = pair.gain;
}

void Associator::read_result(MatchSet& out) {
  for (const Pair& p : pairs_)
    if (auction_.owner(static_cast<std::size_t>(p.track)) == p.corner) give(p, out);
}

/// The auction over all pairs.
void Associator::assign(std::size_t tracks, std::size_t corners) {
  sort_by_corner(corners);
  const auto outcome = auction_.run(tracks, {first_.data(), corners + 1}, {offers_.data(), first_[corners]},
                                    {config_.epsilon_px, static_cast<std::uint32_t>(config_.max_bids)});
  last_epsilon_ = outcome.epsilon;
  counters_.candidates += first_[corners];
  counters_.bids += outcome.bids;
  counters_.epsilon_raised += outcome.attempts > 1 ? 1 : 0;
}

void Associator::associate(const TrackSet& tracks, const CornerSet& corners, MatchSet& out) {
  ++counters_.frames;
  if (config_.method == AssociateMethod::kKBest) return associate_readings(tracks, corners, out);
  gather(tracks, corners, out);
  assign(tracks.size(), corners.items.size());
  read_result(out);
  if (doubts()) doubt(corners, out);
}

}  // namespace cyclops
