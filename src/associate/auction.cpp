#include "associate/auction.hpp"

#include <algorithm>
#include <limits>

#include "base/result.hpp"

namespace cyclops {

Auction::Auction(std::size_t max_tracks) {
  price_.reserve(max_tracks);
  owner_.reserve(max_tracks);
}

/// The best track for a corner at today's prices; false when it has none worth having, and retires.
bool Auction::choose(const Market& market, std::int32_t corner, Bid& bid) const {
  double best = -std::numeric_limits<double>::infinity(), second = best;
  std::int32_t at = -1;
  for (std::uint32_t k = market.first[corner]; k < market.first[corner + 1]; ++k) {
    const Offer& offer = market.offers[k];
    const double value = offer.gain - price_[offer.track];
    if (value > best) {
      second = best;
      best = value;
      at = offer.track;
    } else if (value > second) {
      second = value;
    }
  }
  if (!(best >= 0)) return false;
  bid = {corner, at, owner_[at], best, std::max(second, 0.0), 0};
  return true;
}

/// False when `max_bids` were not enough. At most one corner is ever displaced and waiting, and its index is below those that
/// have not begun: following it until it settles is the same as "lowest unassigned index first".
bool Auction::attempt(const Market& market, std::uint32_t max_bids, std::uint32_t& bids, std::span<Bid> trace) {
  std::fill(price_.begin(), price_.end(), 0.0);
  std::fill(owner_.begin(), owner_.end(), -1);
  const auto corners = static_cast<std::int32_t>(market.first.size() - 1);
  std::uint32_t n = 0;
  for (std::int32_t next = 0; next < corners; ++next) {
    Bid bid;
    for (std::int32_t corner = next; corner >= 0 && choose(market, corner, bid); corner = bid.displaced) {
      if (n == max_bids) { bids += n; return false; }
      owner_[bid.track] = corner;
      price_[bid.track] += (bid.best - bid.second) + market.epsilon;
      bid.price = price_[bid.track];
      if (n < trace.size()) trace[n] = bid;
      ++n;
    }
  }
  bids += n;
  return true;
}

AuctionOutcome Auction::run(std::size_t tracks, std::span<const std::uint32_t> first, std::span<const Offer> offers,
                            const AuctionRules& rules, std::span<Bid> trace) {
  CYCLOPS_ASSERT(rules.epsilon > 0 && tracks <= price_.capacity() && !first.empty());
  price_.resize(tracks);
  owner_.resize(tracks);
  double largest = 0;
  for (const Offer& offer : offers) largest = std::max(largest, offer.gain);
  AuctionOutcome out;
  for (out.epsilon = rules.epsilon;; out.epsilon *= 10, ++out.attempts) {
    const bool last = out.epsilon >= largest;
    const auto most = last ? std::numeric_limits<std::uint32_t>::max() : rules.max_bids;
    if (attempt({first, offers, out.epsilon}, most, out.bids, trace)) return out;
  }
}

}  // namespace cyclops
