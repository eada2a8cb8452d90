#include "patch/patch_config.hpp"

namespace cyclops {

Result<PatchConfig> PatchConfig::read(ConfigTable& table, PatchConfig c) {
  table.read("enabled", c.enabled);
  table.read_in("half_px", 3, 10, c.half_px);
  table.read_in("least_correlation", 0.0, 0.999, c.least_correlation);
  table.read_in("search_sigmas", 0.5, 10.0, c.search_sigmas);
  table.read_in("search_most_px", 1.0, 8.0, c.search_most_px);
  table.read_in("view_deg", 0.5, 90.0, c.view_deg);
  table.read_in("scale", 1.01, 1.5, c.scale);
  table.read_in("least_support", 0.0, 1.0, c.least_support);
  table.read_in("anchor_floor_px", 0.01, 10.0, c.anchor_floor_px);
  table.read_in("steady_px", 0.01, 10.0, c.steady_px);
  table.read_in("hold_frames", 0, 1000, c.hold_frames);
  table.read_in("hold_steady_px", 0.01, 10.0, c.hold_steady_px);
  table.read_in("hold_floor_px", 0.01, 10.0, c.hold_floor_px);
  table.read_in("sigma_most_px", 0.05, 10.0, c.sigma_most_px);
  return c;
}

}  // namespace cyclops
