// Time of gating, auction and the rest of association for 38, 200 and 1000 features.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "associate/associate.hpp"
#include "test/bench/bench.hpp"

namespace {

using namespace cyclops;

void one_size(int features, int corners, Gate gate) {
  constexpr int kFrames = 200;
  AssociateConfig config;
  config.gate = gate;
  Associator associator(config);
  auto tracks = std::make_unique<TrackSet>();
  auto found = std::make_unique<CornerSet>();
  auto matches = std::make_unique<MatchSet>();
  std::mt19937_64 random(51);
  std::uniform_real_distribution<double> place(100, 900);
  std::normal_distribution<double> noise(0, 3);
  std::vector<double> us;
  for (int n = 0; n < kFrames; ++n) {
    tracks->clear();
    found->items.clear();
    for (int i = 0; i < features; ++i) {
      Track t;
      t.state = TrackState::kLive;
      t.uv_px = {place(random), place(random)};
      t.cov_px2 = 9 * Mat2::Identity();
      tracks->push_back(t);
    }
    for (int j = 0; j < corners; ++j) {  // the detector searches near tracks only, so clutter lies there
      const Track& t = (*tracks)[static_cast<std::size_t>(j % features)];
      Corner c;
      c.uv_px = t.uv_px + (j < features ? 1 : 7) * Vec2(noise(random), noise(random));
      c.cov_px2 = 0.25 * Mat2::Identity();
      found->items.push_back(c);
    }
    const double begin = bench::thread_seconds();
    associator.associate(*tracks, *found, *matches);
    us.push_back(1e6 * (bench::thread_seconds() - begin));
  }
  std::sort(us.begin(), us.end());
  const auto& k = associator.counters();
  std::printf("associate %-11s %5d features %6d corners %8.1f us median %8.1f us p99 %7.0f pairs %7.0f bids\n",
              gate == Gate::kFixed ? "fixed" : "mahalanobis", features, corners, us[kFrames / 2], us[kFrames * 99 / 100],
              static_cast<double>(k.candidates) / kFrames, static_cast<double>(k.bids) / kFrames);
}

}  // namespace

BENCH(associate) {
  for (const Gate gate : {Gate::kFixed, Gate::kMahalanobis})
    for (const auto& [features, corners] : {std::pair{38, 300}, std::pair{200, 1600}, std::pair{1000, 8000}}) one_size(features, corners, gate);
}
