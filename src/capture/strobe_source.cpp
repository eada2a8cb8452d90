#include "capture/strobe_source.hpp"

namespace cyclops {

Result<StrobeConfig> StrobeConfig::read(ConfigTable& strobe) {
  StrobeConfig c;
  double delay_us = 0;
  int edge = 0;
  strobe.read_enum("source", {"gpio", "socket", "none"}, c.kind);
  strobe.read("socket", c.socket);
  strobe.read("chip", c.chip);
  strobe.read_in("line", 0, 4095, c.line);
  strobe.read("line_name", c.line_name);
  strobe.read_choice("edge", {"rising", "falling"}, edge);
  strobe.read_in("delay_us", -100'000, 100'000, delay_us);
  c.rising = edge == 0;
  c.delay = Duration::from_seconds(delay_us * 1e-6);
  return c;
}

std::unique_ptr<StrobeSource> make_strobe_source(const StrobeConfig& config) {
  switch (config.kind) {
    case StrobeKind::kGpio: return make_gpio_strobe(config);
    case StrobeKind::kSocket: return make_socket_strobe(config);
    case StrobeKind::kNone: break;
  }
  return nullptr;
}

}  // namespace cyclops
