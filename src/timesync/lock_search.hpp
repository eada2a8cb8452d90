#pragma once
/// Which edge belongs to which frame, from nothing: for the start, and after any contradiction.
///
/// A strictly periodic strobe looks the same when shifted by a whole period, so the intervals alone cannot tell. What
/// can: a frame never arrives before its exposure ended, and in quiet conditions it arrives less than a period after
/// that. `find_locks` returns every offset edge - tick that the intervals and the arrivals allow; the caller locks only
/// when there is exactly one, or when the gap before the first edge picks one.
/// Threads  stateless. Memory: no heap. Deterministic: edges later than the last arrival play no part.
#include <array>
#include <cstdint>
#include <span>

#include "base/static_vector.hpp"
#include "base/time.hpp"
#include "msg/strobe.hpp"
#include "timesync/ring.hpp"

namespace cyclops {

inline constexpr std::size_t kMaxLockFrames = 8;
using EdgeRing = Ring<StrobeEdge, 256>;

struct LockFrame {
  std::uint64_t number{0};   ///< camera's number, unwrapped
  std::int64_t tick_ns{0};   ///< camera clock at the start of exposure
  Time arrival{};            ///< first packet, service clock
  Duration exposure{};
};

struct LockGates {
  Duration edge_delay{};       ///< edge later than the start of exposure
  Duration transport_max{};    ///< in quiet conditions the first packet comes less than this after the end of exposure
  Duration slack{};            ///< an arrival may be this much before the end of exposure
  Duration residual{};         ///< edge against tick
};

struct LockCandidate {
  Duration edge_minus_tick{};
  Duration misfit{};                                  ///< sum of |residual|
  std::array<std::uint64_t, kMaxLockFrames> edge{};   ///< index into the ring, by frame
};
using LockCandidates = StaticVector<LockCandidate, 8>;

/// Period by the camera's own clock if the frames are evenly spaced, numbers and ticks agree, and their arrivals are quiet;
/// else zero: such frames prove nothing. `quiet` is the largest spread of arrival - tick as a part of the
/// period, `residual` how far a tick may be from even spacing.
Duration quiet_period(std::span<const LockFrame> frames, double quiet, Duration residual);

/// Every frame must have an edge: a lock may come later, but never from edges that happen to lie right. Offsets within `gates.residual` count as one, and the best fit
/// wins; so do offsets closer than an eighth of a period, and the earliest wins: what follows it is a bounce.
void find_locks(std::span<const LockFrame> frames, const EdgeRing& edges, Duration period, const LockGates& gates, LockCandidates& out);

}  // namespace cyclops
