#include <algorithm>

#include "align/aligner_state.hpp"

namespace cyclops {
namespace {

using align::Acquired;
using align::Prior;
using align::squared_distance;
using align::Vec6;

constexpr double kMoment_s = 0.15;  // features have agreed a moment ago
constexpr double kAt_px = 1;        // 1 sigma of a pose that is tried as it is
constexpr double kFound_px = 2;     // 1 sigma of a pose that a search has found

}  // namespace

/// No reading from a prior as it is: a search further around, believed when enough features and navigation bear it out. Where features
/// have agreed a moment ago it counts at once; else the next frame, led by it, has to agree in the usual way before anything is measured.
void Aligner::State::acquire(const PredictionSet& predicted, const CornerSet& corners, Alignment& out) {
  if (!track.prior().valid || track.blind_s() > config.acquire_blind_s) {
    if (nav.valid) acquired = acquirer.search(nav, predicted, corners, scatter, config.acquire_beam);
    if (acquired && !likely(*acquired, nav)) acquired.reset();
    return;
  }
  const Prior& last = track.prior();
  const bool at_once = track.blind_s() < kMoment_s;
  const Prior at = track.around(last.T, kAt_px);
  const int narrow_beam = config.acquire_beam / 4;
  const auto here = acquirer.search(at, predicted, corners, scatter, narrow_beam);
  if (at_once && here && likely(*here, at) && believe(*here, predicted, corners, out)) return;
  const double spread = track.spread_px(last.T, last.P);
  struct Reach {
    double px;
    int beam;
  };
  for (const Reach& reach : {Reach{config.doubt_px, narrow_beam}, Reach{config.acquire_from_px, config.acquire_beam}}) {
    const Prior prior = track.around(last.T, std::max(reach.px, spread));
    acquired = acquirer.search(prior, predicted, corners, scatter, reach.beam);
    if (acquired && (!likely(*acquired, prior) || (here && acquired->evidence < here->evidence + config.doubt_margin))) acquired.reset();
    if (acquired) break;
  }
  if (acquired && at_once) believe(*acquired, predicted, corners, out);
}

bool Aligner::State::likely(const Acquired& found, const Prior& prior) const {
  const auto off = [&](const Prior& p) { return squared_distance(p.T, found.pose.T, p.P); };
  if (off(prior) > align::kContradiction || (nav.valid && off(nav) > align::kContradiction)) return false;
  const double least = std::max<double>(config.acquire_least, config.acquire_support * found.in_view);
  return found.found >= least && found.evidence >= config.acquire_evidence && found.margin >= config.acquire_margin;
}

/// Goes on from a pose that a search has found.
bool Aligner::State::believe(const Acquired& found, const PredictionSet& predicted, const CornerSet& corners, Alignment& out) {
  look(track.around(found.pose.T, kFound_px), predicted, corners, by_search);
  Alignment other;
  other.from_track = true;
  other.evidence = found.evidence;
  other.margin = found.margin;
  refine(by_search, Vec6::Zero(), other);
  compare_with_navigation(other);
  if (!agreed(other, by_search)) return false;
  other.consensus = true;
  out = other;
  used = &by_search;
  return true;
}

/// Too few features found a corner: is there a pose some pixels away that explains the corners better?
void Aligner::State::doubt(const PredictionSet& predicted, const CornerSet& corners, Alignment& out) {
  if (!out.consensus || config.doubt_px <= 0 || support(out) >= config.sure_support) return;
  const auto here = acquirer.search(track.around(out.T_c_k, kAt_px), predicted, corners, scatter, config.doubt_beam);
  auto there = acquirer.search(track.around(out.T_c_k, config.doubt_px), predicted, corners, scatter, config.doubt_beam);
  if (!here || !there || there->evidence < here->evidence + config.doubt_margin) return;
  there->margin = there->evidence - here->evidence;
  const double disagreement = nav.valid ? squared_distance(nav.T, there->pose.T, nav.P + there->pose.P) : 0;
  if (disagreement >= std::max(align::kContradiction, out.nav_disagreement)) return;
  corrected = believe(*there, predicted, corners, out);
}

}  // namespace cyclops
