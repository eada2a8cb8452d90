#include "associate/k_best.hpp"

#include <algorithm>
#include <limits>

#include "base/result.hpp"

namespace cyclops {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

}  // namespace

KBest::KBest(const Room& room) : room_(room) {
  const std::size_t side = room.tracks + room.corners;
  column_of_.assign(room.corner_numbers, -1);
  corner_.reserve(room.corners);
  pool_.resize(room.solutions + 2);
  for (Node& n : pool_) {
    n.forbidden.reserve(room.solutions + 1);
    n.column.reserve(side);
    n.row.reserve(side);
    n.u.reserve(side);
    n.v.reserve(side);
  }
  free_.reserve(pool_.size());
  open_.reserve(pool_.size());
  solutions_.resize(room.solutions);
  for (Solution& s : solutions_) s.corner.reserve(room.tracks);
  distance_.reserve(side);
  from_.reserve(side);
  done_.reserve(side);
  closed_.reserve(side);
}

/// Corners that are claimed get columns 0, 1 ... in the order of their first claim. False when there are too many.
bool KBest::number_corners(std::span<const Claim> claims) {
  for (const std::int32_t corner : corner_) column_of_[at(corner)] = -1;
  corner_.clear();
  for (const Claim& c : claims) {
    CYCLOPS_ASSERT(c.corner >= 0 && at(c.corner) < room_.corner_numbers);
    if (column_of_[at(c.corner)] >= 0) continue;
    if (corner_.size() == room_.corners) return false;
    column_of_[at(c.corner)] = static_cast<std::int32_t>(corner_.size());
    corner_.push_back(c.corner);
  }
  return true;
}

// --- one shortest augmenting path ------------------------------------------------------------------------------

void KBest::reach(const Node& node, std::int32_t row, std::size_t column, double distance) {
  if (done_[column] != 0 || closed_[column] != 0) return;
  const double d = distance - node.u[at(row)] - node.v[column];
  if (d >= distance_[column]) return;
  distance_[column] = d;
  from_[column] = row;
}

/// All columns that `row` may have; costs are gains with the sign changed.
void KBest::relax(const Node& node, std::int32_t row, double before) {
  const std::size_t corners = corner_.size(), r = at(row);
  if (r < tracks_) {
    for (std::uint32_t k = first_[r]; k < first_[r + 1]; ++k) reach(node, row, at(column_of_[at(claims_[k].corner)]), before - claims_[k].gain);
    reach(node, row, corners + r, before);
  } else {
    reach(node, row, r - tracks_, before);
    for (std::size_t i = 0; i < tracks_; ++i) reach(node, row, corners + i, before);
  }
}

std::int32_t KBest::nearest() const {
  double least = kInfinite;
  std::int32_t best = -1;
  for (std::size_t c = 0; c < distance_.size(); ++c)
    if (done_[c] == 0 && distance_[c] < least) {
      least = distance_[c];
      best = static_cast<std::int32_t>(c);
    }
  return best;
}

/// Dijkstra over reduced costs from a row without column to the nearest free column; -1 when there is none nearer than `limit`.
std::int32_t KBest::shortest_path(const Node& node, std::size_t row, double limit) {
  const std::size_t side = tracks_ + corner_.size();
  distance_.assign(side, kInfinite);
  from_.assign(side, -1);
  done_.assign(side, 0);
  closed_.assign(side, 0);
  for (std::size_t i = 0; i < node.fixed; ++i)
    if (i != row) closed_[at(node.column[i])] = 1;
  for (const std::int32_t c : node.forbidden) closed_[at(c)] = 1;
  relax(node, static_cast<std::int32_t>(row), 0);
  for (const std::int32_t c : node.forbidden) closed_[at(c)] = 0;  // to others they are open
  for (;;) {
    const std::int32_t c = nearest();
    if (c < 0 || distance_[at(c)] >= limit) return -1;
    if (node.row[at(c)] < 0) return c;
    done_[at(c)] = 1;
    relax(node, node.row[at(c)], distance_[at(c)]);
  }
}

/// Gives `row` a column at the least cost, others give way. False when that would cost `limit` or more, or cannot be.
bool KBest::augment(Node& node, std::size_t row, double limit) {
  const std::int32_t end = shortest_path(node, row, limit);
  if (end < 0) return false;
  const double length = distance_[at(end)];
  node.u[row] += length;
  for (std::size_t c = 0; c < done_.size(); ++c)
    if (done_[c] != 0) {
      node.v[c] -= length - distance_[c];
      node.u[at(node.row[c])] += length - distance_[c];
    }
  for (std::int32_t c = end;;) {
    const std::int32_t r = from_[at(c)];
    std::swap(c, node.column[at(r)]);
    node.row[at(node.column[at(r)])] = r;
    if (at(r) == row) break;
  }
  node.cost += length;
  return true;
}

// --- the best one, and the parts -------------------------------------------------------------------------------

/// From nothing: the clutter has its corners, each track asks for its cheapest column.
void KBest::solve(Node& node) {
  const std::size_t corners = corner_.size(), side = tracks_ + corners;
  node.cost = 0;
  node.fixed = 0;
  node.forbidden.clear();
  node.column.assign(side, -1);
  node.row.assign(side, -1);
  node.u.assign(side, 0);
  node.v.assign(side, 0);
  for (std::size_t j = 0; j < corners; ++j) {
    node.column[tracks_ + j] = static_cast<std::int32_t>(j);
    node.row[j] = static_cast<std::int32_t>(tracks_ + j);
  }
  for (std::size_t i = 0; i < tracks_; ++i) {
    for (std::uint32_t k = first_[i]; k < first_[i + 1]; ++k) node.u[i] = std::min(node.u[i], -claims_[k].gain);
    node.cost += node.u[i];
  }
  for (std::size_t i = 0; i < tracks_; ++i) CYCLOPS_ASSERT(augment(node, i, kInfinite));
}

/// Tracks before `track` as the parent has them, `track` without what it has there and had to do without before.
void KBest::make_part(const Node& parent, std::size_t track, Node& out) const {
  out = parent;  // no heap: the room was reserved
  if (track != parent.fixed) out.forbidden.clear();
  out.fixed = track;
  out.forbidden.push_back(parent.column[track]);
  out.row[at(parent.column[track])] = -1;
  out.column[track] = -1;
}

/// Puts a candidate in its place; the dearest goes when there are more than can still be wanted.
void KBest::keep(std::size_t slot) {
  const double cost = pool_[slot].cost;
  const auto place = std::find_if(open_.begin(), open_.end(), [&](std::size_t o) { return pool_[o].cost <= cost; });
  open_.insert(place, slot);
  if (open_.size() <= most_ - found_) return;
  free_.push_back(open_.front());
  open_.erase(open_.begin());
}

void KBest::split(const Node& parent) {
  for (std::size_t track = parent.fixed; track < tracks_; ++track) {
    if (first_[track] == first_[track + 1]) continue;
    const bool full = open_.size() == most_ - found_;
    if (most_ == found_) return;
    const std::size_t slot = free_.back();
    free_.pop_back();
    Node& part = pool_[slot];
    make_part(parent, track, part);
    const double limit = full ? pool_[open_.front()].cost - parent.cost : kInfinite;
    if (augment(part, track, limit)) keep(slot);
    else free_.push_back(slot);
  }
}

void KBest::emit(const Node& node) {
  Solution& s = solutions_[found_++];
  s.total = 0;
  s.corner.assign(tracks_, -1);
  for (std::size_t i = 0; i < tracks_; ++i) {
    if (at(node.column[i]) >= corner_.size()) continue;
    s.corner[i] = corner_[at(node.column[i])];
    for (std::uint32_t k = first_[i]; k < first_[i + 1]; ++k)
      if (claims_[k].corner == s.corner[i]) s.total += claims_[k].gain;
  }
}

std::size_t KBest::run(std::span<const std::uint32_t> first, std::span<const Claim> claims, std::size_t k) {
  CYCLOPS_ASSERT(!first.empty() && k > 0 && k <= room_.solutions);
  found_ = 0;
  most_ = k;
  tracks_ = first.size() - 1;
  first_ = first;
  claims_ = claims;
  if (tracks_ > room_.tracks || !number_corners(claims)) return 0;
  open_.clear();
  free_.clear();
  for (std::size_t i = pool_.size(); i-- > 0;) free_.push_back(i);
  std::size_t slot = free_.back();
  free_.pop_back();
  solve(pool_[slot]);
  for (;;) {
    emit(pool_[slot]);
    split(pool_[slot]);
    free_.push_back(slot);
    if (open_.empty() || found_ == most_) return found_;
    slot = open_.back();
    open_.pop_back();
  }
}

}  // namespace cyclops
