#include <memory>
#include <random>

#include "segment/segment.hpp"
#include "test/bench/bench.hpp"

namespace cyclops {
namespace {

void race(const char* what, int n, double width, double height, double link_px) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vec2> points;
  for (int i = 0; i < n; ++i) points.emplace_back(width * unit(random), height * unit(random));
  SegmentConfig config;
  config.link_px = link_px;
  auto segmenter = std::make_unique<Segmenter>(config);
  auto out = std::make_unique<SubImageSet>();
  bench::Race race(what, 1, "us/frame", 1e-6);
  race.add("cyclops", [&] { segmenter->segment(points, 4096, 4096, *out); });
  race.run();
}

BENCH(segment) {
  race("segment: 38 points over 1024x1024", 38, 1024, 1024, 61);
  race("segment: 1024 points over 4096x4096", 1024, 4096, 4096, 61);
  race("segment: 1024 points over 4096x4096, no link", 1024, 4096, 4096, 2);
  race("segment: 1024 points within 200x200", 1024, 200, 200, 61);
}

}  // namespace
}  // namespace cyclops
