#pragma once
/// Merges frames and TSPI by sensor time: each frame leaves with the relative state of its own mid-exposure time.
///
/// Order    frames leave in the order they came in. The oldest leaves as soon as
///            - TSPI of both aircraft covers its t_mid, or
///            - it is no navigation update (NavSchedule) or has no time: it does not wait, or
///            - a frame with t_mid later by at least max_wait_ms has come in, or
///            - more than max_waiting_frames wait (counted), or
///            - flush(): end of the stream, or the caller's own patience with a silent camera.
///          The relative state is worked out at that moment, so it depends on the order of the inputs alone, not on when
///          pop() is called. While TSPI keeps pace it does not even depend on how frames and TSPI were interleaved.
/// Caller   takes what is ready with pop(); more than kReadyRoom frames left lying there is a broken contract.
/// Time     service clock. Threads: one at a time. Memory: allocated on construction only.
#include <cstdint>
#include <vector>

#include "msg/frame.hpp"
#include "nav/navigator.hpp"
#include "nav/schedule.hpp"

namespace cyclops {

struct AlignedFrame {
  FrameInfo frame{};
  std::uint64_t token{0};                 ///< the caller's, untouched: index of a pooled frame, for example
  bool scheduled{false};                  ///< this frame is a navigation update, whether or not navigation was there
  NavAnswer nav{};
};

struct AlignerCounters {
  std::uint64_t frames{0};
  std::uint64_t covered{0};               ///< left because TSPI covered them
  std::uint64_t not_needed{0};            ///< no navigation update, or no frame time
  std::uint64_t timed_out{0};             ///< left because a frame max_wait_ms later came in
  std::uint64_t squeezed_out{0};          ///< left because too many waited
  std::uint64_t flushed{0};
  std::uint64_t without_nav{0};           ///< navigation updates that left without a valid state
  std::uint64_t most_waiting{0};          ///< high water
};

class FrameAligner {
 public:
  static constexpr std::size_t kReadyRoom = 256;  ///< more than the stage before can let go at once
  FrameAligner(const NavConfig& config, const NavRig& rig);

  Admission push(const Tspi& sample);
  void push(const FrameInfo& frame, std::uint64_t token);
  void flush();
  /// The next frame that is ready, in order; false when none is.
  bool pop(AlignedFrame& out);

  [[nodiscard]] std::size_t waiting() const { return size_ - ready_; }
  [[nodiscard]] const Navigator& navigator() const { return navigator_; }
  [[nodiscard]] const AlignerCounters& counters() const { return counters_; }

 private:
  AlignedFrame& slot(std::size_t i) { return slots_[(head_ + i) % slots_.size()]; }
  void settle();
  /// Works out the oldest waiting frame and counts why it goes.
  void release(std::uint64_t AlignerCounters::*why);

  NavConfig config_;
  Navigator navigator_;
  NavSchedule schedule_;
  std::vector<AlignedFrame> slots_;
  std::size_t head_{0};
  std::size_t size_{0};
  std::size_t ready_{0};                  ///< the first of them, worked out and not yet taken
  bool any_time_{false};
  Time t_latest_{};                       ///< latest t_mid that came in
  AlignerCounters counters_{};
};

}  // namespace cyclops
