#pragma once
/// What comes in over LCM: one door a channel, in front of the decoders. Thread: link.
#include <array>
#include <optional>

#include <lcm/lcm.h>

#include "service/pipeline.hpp"
#include "service/pipeline_state.hpp"
#include "wire/link_gate.hpp"

namespace cyclops {

class LinkDoors {
 public:
  explicit LinkDoors(Pipeline::State& s);
  /// Subscribes each channel, and with a key its SIGNED_ twin.
  void open(lcm_t* lcm);

 private:
  struct Door {
    LinkDoors* owner;
    Link link;
    LinkGate gate;
  };
  static void on_message(const lcm_recv_buf_t* buffer, const char* name, void* door);
  void take(Door& door, bool wrapped, const lcm_recv_buf_t& buffer);
  Result<> decode(Link link, std::span<const std::uint8_t> message);
  void refused(Door& door, const Error& error, bool undecodable);

  Pipeline::State& s_;
  std::array<std::optional<Door>, kLinks> doors_{};
  std::uint64_t refusals_[kLinks]{};
};

}  // namespace cyclops
