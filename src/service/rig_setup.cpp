#include "service/rig_setup.hpp"

namespace cyclops {

FrameStamperConfig stamper_config(const Rig& rig) {
  FrameStamperConfig c;
  c.period = Duration::from_seconds(1.0 / rig.frame_rate_hz);
  c.edge_delay = Duration::from_seconds(rig.strobe_delay_us * 1e-6);
  c.rising = rig.strobe_rising;
  c.transport_max = Duration::from_ms(rig.transport_max_ms);
  c.id_bits = rig.block_ids_16_bit ? 16 : 64;
  return c;
}

NavRig nav_rig(const Rig& rig) { return {rig.receiver_ins_from_tspi_m, rig.tanker_ins_from_tspi_m}; }

}  // namespace cyclops
