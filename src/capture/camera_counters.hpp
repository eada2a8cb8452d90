#pragma once
/// What capture has seen since the service started. Numbers only grow.
#include <cstdint>

namespace cyclops {

struct PacketCounters {
  std::uint64_t received{0};
  std::uint64_t missing{0};          ///< of frames that were given up
  std::uint64_t resend_requested{0};
  std::uint64_t resent{0};           ///< arrived after they were asked for again
  std::uint64_t refused{0};          ///< the camera could not send them again
  std::uint64_t duplicated{0};
  std::uint64_t ignored{0};          ///< of frames that were closed already, or whose number went back
  std::uint64_t no_buffer{0};        ///< came while every buffer was in use
};

struct CameraCounters {
  std::uint64_t received{0};            ///< frames with every pixel
  std::uint64_t incomplete{0};          ///< frames with missing rows
  std::uint64_t lost_leader{0};         ///< frames of which number and time are unknown
  std::uint64_t lost_gap{0};            ///< numbers that never came
  std::uint64_t lost_no_buffer{0};      ///< the same, while every buffer was in use
  std::uint64_t lost_size_mismatch{0};  ///< frames of another size or format than configured
  std::uint64_t lost_rows_unknown{0};   ///< frames with no certain row
  std::uint64_t lost_frozen{0};         ///< frames with the picture of an earlier one
  std::uint64_t aborted{0};             ///< cut by the end of a stream
  std::uint64_t unexpected{0};          ///< buffers the library gave back without a frame
  std::uint64_t starts{0};              ///< streams started; the first is one
  std::uint64_t losses{0};              ///< streams that ended
  std::uint64_t failed_opens{0};
  PacketCounters packets;
};

}  // namespace cyclops
