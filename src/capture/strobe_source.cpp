#include "capture/strobe_source.hpp"

namespace cyclops {
namespace {

/// Interface v2 of the kernel, and the library where a kernel has none.
class BestGpio final : public StrobeSource {
 public:
  explicit BestGpio(const StrobeConfig& config) : config_(config), used_(make_uapi_strobe(config)) {}
  Result<> open() override {
    auto opened = used_->open();
    if (opened.ok() || opened.error().code != ErrorCode::kUnsupported) return opened;
    used_ = make_gpiod_strobe(config_);
    return used_->open();
  }
  Result<bool> wait(Duration timeout) override { return used_->wait(timeout); }
  Result<std::size_t> read_many(std::span<StrobeEdge> out) override { return used_->read_many(out); }
  [[nodiscard]] StrobeStatus status() const override { return used_->status(); }

 private:
  StrobeConfig config_;
  std::unique_ptr<StrobeSource> used_;
};

}  // namespace

std::unique_ptr<StrobeSource> make_gpio_strobe(const StrobeConfig& config) {
  if (CYCLOPS_GPIOD >= 2) return make_gpiod_strobe(config);
  return std::make_unique<BestGpio>(config);
}

Result<StrobeConfig> StrobeConfig::read(ConfigTable& strobe, const StrobeConfig& defaults) {
  StrobeConfig c = defaults;
  double delay_us = c.delay.seconds() * 1e6, delay_sigma_us = c.delay_sigma.seconds() * 1e6;
  int edge = c.rising ? 0 : 1;
  strobe.read_enum("source", {"gpio", "socket", "none"}, c.kind);
  strobe.read("socket", c.socket);
  strobe.read("chip", c.chip);
  strobe.read_in("line", 0, 4095, c.line);
  strobe.read("line_name", c.line_name);
  strobe.read_choice("edge", {"rising", "falling"}, edge);
  strobe.read_in("delay_us", -100'000, 100'000, delay_us);
  strobe.read_in("delay_sigma_us", 0, 10'000, delay_sigma_us);
  c.rising = edge == 0;
  c.delay_sigma = Duration::from_seconds(delay_sigma_us * 1e-6);
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
