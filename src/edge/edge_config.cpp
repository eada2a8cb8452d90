#include "edge/edge_config.hpp"

#include "msg/chain.hpp"

namespace cyclops {

Result<EdgeConfig> EdgeConfig::read(ConfigTable& table, EdgeConfig c) {
  table.read("enabled", c.enabled);
  table.read_in("pairs", 1, static_cast<int>(EdgeSet::capacity()), c.pairs);
  table.read_in("search_sigmas", 0.5, 10.0, c.search_sigmas);
  table.read_in("search_least_px", 1.0, 15.0, c.search_least_px);
  table.read_in("search_most_px", 1.0, 15.0, c.search_most_px);
  table.read_in("contrast_sigmas", 0.0, 1e3, c.contrast_sigmas);
  table.read_in("coverage", 0.1, 1.0, c.coverage);
  table.read_in("straight_px", 0.1, 5.0, c.straight_px);
  table.read_in("bias_sigma_px", 0.01, 10.0, c.bias_sigma_px);
  table.read_in("bias_gain", 0.0, 1.0, c.bias_gain);
  table.read_in("bias_floor_px", 0.01, 10.0, c.bias_floor_px);
  table.read_in("proven", 0.0, 1.0, c.proven);
  table.read_in("strength_gain", 0.001, 1.0, c.strength_gain);
  table.read_in("crossing_sigma_px", 0.05, 10.0, c.crossing_sigma_px);
  if (c.search_least_px > c.search_most_px) table.fail("search_least_px", "is more than search_most_px");
  return c;
}

}  // namespace cyclops
