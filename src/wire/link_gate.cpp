#include "wire/link_gate.hpp"

#include <algorithm>

namespace cyclops {

bool RateLimit::pass(Time now) {
  if (last_ && now > *last_) credit_ns_ = std::min(most_ns_, credit_ns_ + std::min(most_ns_, (now - *last_).ns));
  if (!last_ || now > *last_) last_ = now;
  if (credit_ns_ < price_ns_) return false;
  credit_ns_ -= price_ns_;
  return true;
}

LinkGate::LinkGate(std::string channel, LinkGateConfig config)
    : channel_(std::move(channel)), limit_(config.rate_hz, config.burst), plain_limit_(config.rate_hz, config.burst) {
  if (config.key) verifier_.emplace(*config.key, channel_, config.freshness);
}

Result<std::span<const std::uint8_t>> LinkGate::step(bool wrapped, const void* data, std::size_t size, Time now, std::int64_t utc_ns) {
  ++counters_.received;
  if (!(wrapped ? limit_ : plain_limit_).pass(now)) {
    ++counters_.flooded;
    return make_error(ErrorCode::kFull, channel_, "more messages than the channel may bring");
  }
  if (!verifier_) return std::span(static_cast<const std::uint8_t*>(data), size);
  if (!wrapped) {
    ++counters_.not_authentic;
    return make_error(ErrorCode::kUnusable, channel_, "not authentic: came without a tag, expected on SIGNED_" + channel_);
  }
  auto inside = verifier_->open(data, size, utc_ns);
  if (inside.ok()) return inside;
  ++(inside.error().code == ErrorCode::kTimeout ? counters_.replayed : counters_.not_authentic);
  return inside;
}

}  // namespace cyclops
