#include "flow/flow_config.hpp"

namespace cyclops {

Result<FlowConfig> FlowConfig::read(ConfigTable& table, FlowConfig c) {
  table.read("enabled", c.enabled);
  table.read_in("least_correlation", 0.0, 0.999, c.least_correlation);
  table.read_in("least_margin", 0.0, 1.0, c.least_margin);
  return c;
}

}  // namespace cyclops
