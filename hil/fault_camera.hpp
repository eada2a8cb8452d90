#pragma once
/// Faults of the camera and of its network, made inside the bench camera.
///
/// Threads  packet() by the threads of the device, under its lock; the rest by the one thread that sends frames.
#include <array>
#include <vector>

#include "hil/fault_player.hpp"
#include "hil/gige_faults.hpp"
#include "msg/frame.hpp"

namespace cyclops::hil {

class CameraFaults {
 public:
  explicit CameraFaults(FaultPlayer& player) : player_(player) {}
  /// What happens to a packet; to be given to the device.
  [[nodiscard]] PacketFate packet(const PacketRef& packet);
  /// The picture that is really sent: a frozen one, or one brighter or darker by `light`. It lives until the next call.
  [[nodiscard]] ImageView picture(const ImageView& taken, double light);
  /// How much later than due this frame leaves.
  [[nodiscard]] Duration delay();

 private:
  struct Doom {                 ///< of one frame, the same for packets sent again
    std::uint64_t block_id{0};
    std::uint32_t keep{UINT32_MAX};
  };
  Doom& doom_of(const PacketRef& packet);
  [[nodiscard]] PacketFate fate(const PacketRef& packet);
  FaultPlayer& player_;
  std::array<Doom, 16> dooms_{};
  std::size_t next_doom_{0};
  std::vector<std::uint8_t> frozen_, lit_;
};

}  // namespace cyclops::hil
