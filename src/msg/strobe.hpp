#pragma once
/// Hardware instants: an exposure edge, and one instant on two clocks.
#include <cstdint>

#include "base/time.hpp"

namespace cyclops {

struct StrobeEdge {
  Time t{};                ///< kernel stamp, service clock
  std::int64_t line_seq{-1};  ///< number of the edge on its line; -1 when the source cannot tell (uAPI v1)
  bool rising{true};
};

struct PpsEdge {           ///< an edge of the other line: where a GPS second begins
  StrobeEdge edge{};
};

struct TimeMark {
  Time t{};
  GpsTime t_gps{};
  Duration sigma{};
};

}  // namespace cyclops
