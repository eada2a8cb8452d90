#include "associate/k_best.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "associate/auction.hpp"
#include "exact.hpp"

namespace cyclops {
namespace {

using test::Gains;

constexpr std::size_t kCorners = 400;

/// The gains of a problem by track, as KBest wants them; below 0: forbidden.
struct Lists {
  explicit Lists(const Gains& gain) {
    for (const auto& row : gain) {
      for (std::size_t j = 0; j < row.size(); ++j)
        if (row[j] >= 0) claims.push_back({static_cast<std::int32_t>(j), row[j]});
      first.push_back(static_cast<std::uint32_t>(claims.size()));
    }
  }
  std::vector<std::uint32_t> first{0};
  std::vector<Claim> claims;
};

/// Totals of all partial assignments, best first.
void try_all(const Gains& gain, std::size_t track, std::uint32_t used, double total, std::vector<double>& out) {
  if (track == gain.size()) {
    out.push_back(total);
    return;
  }
  try_all(gain, track + 1, used, total, out);
  for (std::size_t j = 0; j < gain[track].size(); ++j)
    if (gain[track][j] >= 0 && (used >> j & 1U) == 0) try_all(gain, track + 1, used | 1U << j, total + gain[track][j], out);
}

Gains random_gains(std::mt19937& random, std::size_t tracks, std::size_t corners, double share) {
  std::uniform_real_distribution<double> gain(0, 12), chance(0, 1);
  Gains out(tracks, std::vector<double>(corners, -1));
  for (auto& row : out)
    for (double& g : row)
      if (chance(random) < share) g = gain(random);
  return out;
}

double sum(const Gains& gain, std::span<const std::int32_t> corners) {
  double total = 0;
  for (std::size_t i = 0; i < corners.size(); ++i)
    if (corners[i] >= 0) total += gain[i][static_cast<std::size_t>(corners[i])];
  return total;
}

TEST(KBest, GivesTheKBestTotalsThatTryingAllGives) {
  // GIVEN small random problems, sparse and dense
  // WHEN the k best are asked for, with more asked than some have
  // THEN they are those of an enumeration of everything, in order, each a different assignment
  std::mt19937 random(4711);
  KBest best({.tracks = 8, .corners = 16, .solutions = 40, .corner_numbers = kCorners});
  for (int trial = 0; trial < 600; ++trial) {
    const Gains gain = random_gains(random, 1 + random() % 5, 1 + random() % 6, 0.2 + 0.8 * static_cast<double>(random() % 100) / 100);
    std::vector<double> all;
    try_all(gain, 0, 0, 0, all);
    std::sort(all.rbegin(), all.rend());
    const Lists lists(gain);
    const std::size_t k = 1 + random() % 40;
    const std::size_t n = best.run(lists.first, lists.claims, k);
    ASSERT_EQ(n, std::min(k, all.size()));
    std::set<std::vector<std::int32_t>> different;
    for (std::size_t i = 0; i < n; ++i) {
      ASSERT_NEAR(best.total(i), all[i], 1e-9) << "trial " << trial << " solution " << i;
      ASSERT_NEAR(sum(gain, best.corners(i)), best.total(i), 1e-9);
      different.insert({best.corners(i).begin(), best.corners(i).end()});
    }
    EXPECT_EQ(different.size(), n);
  }
}

TEST(KBest, NoCornerIsGivenTwice) {
  std::mt19937 random(5);
  KBest best({.tracks = 40, .corners = 300, .solutions = 10, .corner_numbers = kCorners});
  const Gains gain = random_gains(random, 30, 40, 0.3);
  const Lists lists(gain);
  const std::size_t n = best.run(lists.first, lists.claims, 10);
  ASSERT_EQ(n, 10U);
  for (std::size_t i = 0; i < n; ++i) {
    std::set<std::int32_t> seen;
    for (std::size_t track = 0; track < gain.size(); ++track) {
      const std::int32_t c = best.corners(i)[track];
      if (c < 0) continue;
      EXPECT_TRUE(seen.insert(c).second);
      EXPECT_GE(gain[track][static_cast<std::size_t>(c)], 0);
    }
  }
}

TEST(KBest, TheFirstIsTheAuctionsAndTheExactBest) {
  // GIVEN frames of thirty-eight tracks and whole gains, for which the auction with epsilon below 1 / n is exact
  std::mt19937 random(17);
  KBest best({.tracks = 64, .corners = 300, .solutions = 4, .corner_numbers = kCorners});
  Auction auction(64);
  for (int trial = 0; trial < 20; ++trial) {
    Gains gain = random_gains(random, 38, 200, 0.04);
    for (auto& row : gain)
      for (double& g : row) g = g < 0 ? g : std::floor(g);
    const Lists lists(gain);
    ASSERT_EQ(best.run(lists.first, lists.claims, 4), 4U);
    std::vector<std::uint32_t> first{0};
    std::vector<Offer> offers;
    for (std::size_t j = 0; j < 200; ++j) {
      for (std::size_t i = 0; i < 38; ++i)
        if (gain[i][j] >= 0) offers.push_back({static_cast<std::int32_t>(i), gain[i][j]});
      first.push_back(static_cast<std::uint32_t>(offers.size()));
    }
    auction.run(38, first, offers, {0.02, 1000000});
    double total = 0;
    for (std::size_t i = 0; i < 38; ++i)
      if (auction.owner(i) >= 0) total += gain[i][static_cast<std::size_t>(auction.owner(i))];
    EXPECT_NEAR(best.total(0), total, 1e-9);
    EXPECT_NEAR(best.total(0), test::best_by_kuhn_munkres(gain, 200), 1e-9);
    for (std::size_t i = 1; i < 4; ++i) EXPECT_LE(best.total(i), best.total(i - 1) + 1e-12);
  }
}

TEST(KBest, RanksTheWorkedExampleOfTheSpecification) {
  // GIVEN the gains of spec 2.5, whose optimum is 26 and whose runner-up is 24
  const Gains gain{{7, 9, 12, 7, -1}, {4, 6, 11, 10, -1}, {-1, -1, 1, 6, -1}, {-1, -1, -1, -1, -1}};
  KBest best({.tracks = 8, .corners = 8, .solutions = 64, .corner_numbers = kCorners});
  const Lists lists(gain);
  EXPECT_EQ(best.run(lists.first, lists.claims, 64), 47U);  // all feasible ones
  EXPECT_DOUBLE_EQ(best.total(0), 26);
  EXPECT_EQ(std::vector<std::int32_t>(best.corners(0).begin(), best.corners(0).end()), (std::vector<std::int32_t>{1, 2, 3, -1}));
  EXPECT_DOUBLE_EQ(best.total(1), 24);
  EXPECT_DOUBLE_EQ(best.total(46), 0);
}

TEST(KBest, AProblemThatDoesNotFitIsRefusedAndTheNextOneIsSolved) {
  KBest best({.tracks = 2, .corners = 2, .solutions = 2, .corner_numbers = kCorners});
  const Lists many({{1, 2, 3}}), tracks({{1}, {1}, {1}}), right({{1, 2}, {3, -1}});
  EXPECT_EQ(best.run(many.first, many.claims, 2), 0U);
  EXPECT_EQ(best.run(tracks.first, tracks.claims, 2), 0U);
  EXPECT_EQ(best.run(right.first, right.claims, 2), 2U);
  EXPECT_DOUBLE_EQ(best.total(0), 5);
}

TEST(KBest, WithoutClaimsThereIsOneSolutionNothing) {
  KBest best({.tracks = 4, .corners = 4, .solutions = 4, .corner_numbers = kCorners});
  const Lists none({{-1}, {-1}});
  EXPECT_EQ(best.run(none.first, none.claims, 4), 1U);
  EXPECT_EQ(best.corners(0)[1], -1);
}

}  // namespace
}  // namespace cyclops
