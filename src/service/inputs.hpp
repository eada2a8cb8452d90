#pragma once
/// Everything that reaches the chain's thread, in one order: that order alone decides the results.
#include <cstddef>
#include <type_traits>
#include <variant>

#include "base/static_vector.hpp"
#include "capture/camera_source.hpp"
#include "capture/strobe_source.hpp"
#include "msg/strobe.hpp"
#include "msg/tspi.hpp"

namespace cyclops {

inline constexpr std::size_t kMaxTspiBytes = 256;

struct TimedFrame {
  CameraFrame frame;
  std::int64_t complete_ns{0};   ///< host steady clock when the last packet was in; only for latency
};
struct AcquisitionStarted {
  Time t{};                      ///< edges before this belong to an earlier acquisition
};
struct ArrivedTspi {
  TspiReport report{};
  Time arrival{};                ///< host steady clock, whole us: what a record can hold
  StaticVector<std::uint8_t, kMaxTspiBytes> bytes{};  ///< as it came
};
struct Idle {};                  ///< the camera has been silent: nothing more comes for what waits

using Input = std::variant<Idle, TimedFrame, AcquisitionStarted, StrobeEdge, PpsEdge, FrameArrival, ArrivedTspi, TimeMark>;

/// Place of a kind in Input.
template <class Kind, class... Kinds>
constexpr std::size_t index_in(const std::variant<Kinds...>*) {
  std::size_t i = 0;
  (void)((std::is_same_v<Kind, Kinds> || (++i, false)) || ...);
  return i;
}
template <class Kind>
constexpr std::size_t input_index() { return index_in<Kind>(static_cast<const Input*>(nullptr)); }

}  // namespace cyclops
