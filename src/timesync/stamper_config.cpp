#include <string>

#include "timesync/frame_stamper.hpp"

namespace cyclops {
namespace {

struct Bound { const char* key; double value, low, high; };

}  // namespace

Result<FrameStamperConfig> FrameStamperConfig::read(ConfigTable& time) {
  FrameStamperConfig c;
  double transport_ms = c.transport_max.seconds() * 1e3, holdover_s = c.tick_holdover.seconds();
  std::int64_t first = static_cast<std::int64_t>(c.first_frame_id);
  time.read_in("transport_max_ms", 0, 1000, transport_ms);
  double wander_ppm = c.clock.wander_per_rs * 1e6;
  time.read_in("tick_holdover_s", 0, 3600, holdover_s);
  time.read_in("clock_wander_ppm", 1e-4, 10, wander_ppm);
  time.read_in("max_wait_frames", 1, 32, c.max_wait_frames);
  time.read("first_frame_id", first);
  if (first < 0) time.fail("first_frame_id", "is " + std::to_string(first) + ", expected 0 or more");
  int bits = c.id_bits == 16 ? 0 : 1;
  time.read_choice("block_ids", {"16 bit", "64 bit"}, bits);
  c.transport_max = Duration::from_ms(transport_ms);
  c.clock.wander_per_rs = wander_ppm * 1e-6;
  c.tick_holdover = Duration::from_seconds(holdover_s);
  c.first_frame_id = static_cast<std::uint64_t>(first);
  c.id_bits = bits == 0 ? 16 : 64;
  return c;
}

Result<> FrameStamperConfig::validated() const {
  const Bound bounds[] = {
      {"period_ms", period.seconds() * 1e3, 1, 10'000},
      {"edge_delay_ms", edge_delay.seconds() * 1e3, -100, 100},
      {"transport_max_ms", transport_max.seconds() * 1e3, 0, 1000},
      {"arrival_slack_ms", arrival_slack.seconds() * 1e3, 0, 100},
      {"residual_max_ms", residual_max.seconds() * 1e3, 0.01, period.seconds() * 1e3 / 8},
      {"delay_sigma_ms", delay_sigma.seconds() * 1e3, 0, 10},
      {"arrival_sigma_ms", arrival_sigma.seconds() * 1e3, 0, 1000},
      {"tick_holdover_s", tick_holdover.seconds(), 0, 3600},
      {"id_bits", static_cast<double>(id_bits == 16 ? 64 : id_bits), 64, 64},
      {"max_wait_frames", static_cast<double>(max_wait_frames), static_cast<double>(lock_frames), 32},
      {"lock_frames", static_cast<double>(lock_frames), 3, static_cast<double>(kMaxLockFrames)},
      {"largest_rate_ppm", clock.largest_rate * 1e6, 1, 1000},
  };
  for (const Bound& b : bounds)
    if (!(b.value >= b.low && b.value <= b.high))
      return make_error(ErrorCode::kInvalid, std::string("time.") + b.key,
                        "is " + std::to_string(b.value) + ", expected " + std::to_string(b.low) + " to " + std::to_string(b.high));
  return Ok{};
}

const char* to_string(LockLoss cause) {
  switch (cause) {
    case LockLoss::kRestart: return "restart";
    case LockLoss::kNumberBack: return "camera numbers started afresh";
    case LockLoss::kTickStep: return "camera number and camera clock disagree";
    case LockLoss::kCount: return "edges and frames counted disagree";
    case LockLoss::kEarlyArrival: return "frame arrived before its exposure had ended";
    case LockLoss::kLateArrival: return "frames evenly late by a period";
    case LockLoss::kResidual: return "edges beside the line";
    case LockLoss::kHoldover: return "no edge for too long";
    case LockLoss::kNumberOf: break;
  }
  return "unknown";
}

}  // namespace cyclops
