#pragma once
/// Turns the camera's block ids into capture numbers that only grow, and tells how many frames are missing in between.
///
/// Ids of 16 bits run 1..65535 and start again at 1; ids of 64 bits do not. Both are taken as they come: a step forward
/// of at most `kMaxGap`, counted round the end of 16 bits, is loss; anything else means that the camera started anew.
/// Threads  one. Memory: no heap.
#include <cstdint>

namespace cyclops {

class FrameNumbers {
 public:
  static constexpr std::uint64_t kMaxGap = 1000;  ///< frames; a longer silence has ended the stream before
  struct Step {
    std::uint64_t seq{0};    ///< capture number of this frame, from 1
    std::uint64_t lost{0};   ///< frames between the last one and this
    bool restarted{false};   ///< the id does not follow: seq and lost say nothing
  };
  /// `id` is not 0.
  Step next(std::uint64_t id);
  /// A frame whose leader was lost: it is taken for the next one.
  Step next_unknown();
  /// A new stream: its first id may be anything. One number is left out to show that frames are lost.
  void new_stream();

 private:
  std::uint64_t last_id_{0};   // 0: none in this stream
  std::uint64_t last_seq_{0};
  std::uint64_t unknown_{0};   // frames numbered since last_id_ without an id
};

}  // namespace cyclops
