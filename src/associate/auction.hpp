#pragma once
/// The auction: corners bid for tracks, each side at most once, the total gain is as large as can be.
///
/// The result is within n * epsilon of the best total, n = the smaller of the two counts; exactly the best when all gains
/// are whole numbers and epsilon < 1/n. A corner whose best offer is below 0 retires, so the auction ends.
/// Bids     an attempt ends after `max_bids`; the next one has ten times the epsilon. An epsilon at or above the largest
///          gain needs at most three bids a track and is not bounded, so a result always comes and is always the same.
/// Threads  one object a thread. Memory: all of it in the constructor.
/// Source   spec 2.5, errata E13 and E14: values are gains less prices, the price of the chosen track rises.
#include <cstdint>
#include <span>
#include <vector>

namespace cyclops {

/// One track that a corner may have.
struct Offer {
  std::int32_t track{0};
  double gain{0};
};

/// One bid, for tests and diagnosis.
struct Bid {
  std::int32_t corner{0};
  std::int32_t track{0};
  std::int32_t displaced{-1};  ///< corner that lost the track, or -1
  double best{0};              ///< v1
  double second{0};            ///< v2, at least 0: staying unmatched is worth 0
  double price{0};             ///< of the track after the bid
};

struct AuctionRules {
  double epsilon{0.01};
  std::uint32_t max_bids{50000};
};

struct AuctionOutcome {
  std::uint32_t bids{0};      ///< over all attempts
  std::uint32_t attempts{1};
  double epsilon{0};          ///< of the attempt that ended
};

class Auction {
 public:
  explicit Auction(std::size_t max_tracks);
  /// Corner j may have offers[first[j]] .. offers[first[j + 1] - 1]; corners bid in the order of their index, lowest first.
  /// The first `trace.size()` bids of the last attempt are written to `trace`.
  AuctionOutcome run(std::size_t tracks, std::span<const std::uint32_t> first, std::span<const Offer> offers,
                     const AuctionRules& rules, std::span<Bid> trace = {});
  /// Corner that owns the track after run(), or -1.
  [[nodiscard]] std::int32_t owner(std::size_t track) const { return owner_[track]; }

 private:
  struct Market {
    std::span<const std::uint32_t> first;
    std::span<const Offer> offers;
    double epsilon;
  };
  bool attempt(const Market& market, std::uint32_t max_bids, std::uint32_t& bids, std::span<Bid> trace);
  [[nodiscard]] bool choose(const Market& market, std::int32_t corner, Bid& bid) const;
  std::vector<double> price_;
  std::vector<std::int32_t> owner_;
};

}  // namespace cyclops
