#include "associate/hypotheses.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops {
namespace {

bool on(const Track& t) { return t.state == TrackState::kLive || t.state == TrackState::kCoasting; }

/// Navigation has just said where it is.
bool placed(const Track& t) { return t.change == TrackChange::kReplacedByNav || t.change == TrackChange::kInitiatedByNav; }

constexpr double kAccelerationPx2S3 = 100;  // as the tracks': what a place loses while nothing is seen

}  // namespace

Hypotheses::Hypotheses(const HypothesesConfig& config, std::size_t max_tracks) : config_(config), max_tracks_(max_tracks) {
  CYCLOPS_ASSERT(config.most > 0);
  slots_.resize(4 * config.most + 2);  // kept, judged (twice as many), and those that will be kept
  for (Reading& r : slots_) {
    r.place.resize(max_tracks);
    r.corner.reserve(max_tracks);
  }
  shift_.reserve(max_tracks);
  for (std::vector<std::size_t>* v : {&now_, &next_, &judged_, &free_}) v->reserve(slots_.size());
  for (std::size_t i = slots_.size(); i-- > 0;) free_.push_back(i);
}

void Hypotheses::take(const Reading& from, Reading& to) {
  to.score = from.score;
  to.own = from.own;
  std::copy(from.place.begin(), from.place.end(), to.place.begin());
}

/// Own places move with the velocity of the track; where there is none, or navigation's is to be believed, the track's place.
void Hypotheses::move_on(Reading& r, const TrackSet& tracks, double dt) const {
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& t = tracks[i];
    Place& p = r.place[i];
    if (!on(t)) {
      p.known = false;
      continue;
    }
    if (!p.known || (placed(t) && !r.own)) {
      p = {true, 0, t.uv_px, t.cov_px2};
      continue;
    }
    p.uv_px += dt * t.velocity_px_s;
    p.cov_px2 += kAccelerationPx2S3 * dt * dt * dt / 3 * Mat2::Identity() + dt * dt * 900 * Mat2::Identity();
  }
}

/// Tracks of an own reading that have left the group, at an update of navigation.
void Hypotheses::gather_strays(Reading& r, const TrackSet& tracks) {
  const auto counts = [&](std::size_t i) { return r.place[i].known && placed(tracks[i]) && r.place[i].misses < config_.most_misses; };
  Vec2 common = Vec2::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    shift_.clear();
    for (std::size_t i = 0; i < tracks.size(); ++i)
      if (counts(i)) shift_.push_back(r.place[i].uv_px[axis] - tracks[i].uv_px[axis]);
    if (shift_.empty()) return;
    const auto middle = shift_.begin() + static_cast<std::ptrdiff_t>(shift_.size() / 2);
    std::nth_element(shift_.begin(), middle, shift_.end());
    common[axis] = *middle;
  }
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (!r.place[i].known || !placed(tracks[i])) continue;
    const Vec2 there = tracks[i].uv_px + common;
    if (!counts(i) || (r.place[i].uv_px - there).norm() > config_.stray_px) r.place[i] = {true, 0, there, tracks[i].cov_px2};
  }
}

std::size_t Hypotheses::begin(const TrackSet& tracks, Time t) {
  CYCLOPS_ASSERT(tracks.size() <= max_tracks_);
  const double dt = begun_ ? std::max(0.0, (t - t_).seconds()) : 0;
  begun_ = true;
  t_ = t;
  const bool fork = std::any_of(tracks.begin(), tracks.end(), [](const Track& x) { return on(x) && x.change == TrackChange::kReplacedByNav; });
  free_.insert(free_.end(), judged_.begin(), judged_.end());
  judged_.clear();
  if (now_.empty()) {
    now_.push_back(free_.back());
    free_.pop_back();
    slots_[now_[0]].score = 0;
    for (Place& p : slots_[now_[0]].place) p.known = false;
  }
  for (const std::size_t slot : now_)
    for (const bool own : {false, true}) {
      if (own && !fork) continue;
      judged_.push_back(free_.back());
      free_.pop_back();
      Reading& r = slots_[judged_.back()];
      take(slots_[slot], r);
      r.own = own;
      r.score *= std::exp(-dt / config_.memory_s);
      move_on(r, tracks, dt);
      if (own) gather_strays(r, tracks);
    }
  return judged_.size();
}

void Hypotheses::expected(std::size_t i, const TrackSet& tracks, TrackSet& out) const {
  const Reading& r = slots_[judged_[i]];
  out.clear();
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    out.push_back(tracks[k]);
    if (!r.place[k].known) continue;
    out[k].uv_px = r.place[k].uv_px;
    out[k].cov_px2 = r.place[k].cov_px2;
  }
}

void Hypotheses::judge(std::size_t i, double gain, std::span<const std::int32_t> corners) {
  const double score = slots_[judged_[i]].score + gain;
  const auto same = std::find_if(next_.begin(), next_.end(), [&](std::size_t s) { return std::equal(corners.begin(), corners.end(), slots_[s].corner.begin(), slots_[s].corner.end()); });
  if (same != next_.end()) {
    if (slots_[*same].score >= score) return;
    free_.push_back(*same);
    next_.erase(same);
  }
  if (next_.size() == config_.most) {
    if (slots_[next_.back()].score >= score) return;
    free_.push_back(next_.back());
    next_.pop_back();
  }
  const std::size_t slot = free_.back();
  free_.pop_back();
  Reading& r = slots_[slot];
  r.score = score;
  r.parent = i;
  r.corner.assign(corners.begin(), corners.end());
  next_.insert(std::find_if(next_.begin(), next_.end(), [&](std::size_t s) { return slots_[s].score < score; }), slot);
}

/// The place of a track that has a corner moves there; one without stays.
void Hypotheses::correct(Reading& r, const CornerSet& corners) const {
  const double a = config_.place_gain;
  for (std::size_t i = 0; i < r.corner.size(); ++i) {
    if (r.corner[i] < 0) {
      ++r.place[i].misses;
      continue;
    }
    r.place[i].misses = 0;
    const Corner& c = corners.items[static_cast<std::size_t>(r.corner[i])];
    Place& p = r.place[i];
    p.uv_px += a * (c.uv_px - p.uv_px);
    p.cov_px2 = (1 - a) * (1 - a) * p.cov_px2 + a * a * c.cov_px2;
  }
}

std::span<const std::int32_t> Hypotheses::settle(const CornerSet& corners) {
  CYCLOPS_ASSERT(!next_.empty());
  for (const std::size_t slot : next_) {
    Reading& r = slots_[slot];
    const double score = r.score;
    take(slots_[judged_[r.parent]], r);
    r.score = score;
    correct(r, corners);
  }
  free_.insert(free_.end(), now_.begin(), now_.end());
  now_.swap(next_);
  next_.clear();
  return slots_[now_[0]].corner;
}

double Hypotheses::margin() const { return now_.size() < 2 ? 1e9 : slots_[now_[0]].score - slots_[now_[1]].score; }

}  // namespace cyclops
