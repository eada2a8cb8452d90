#pragma once
/// The door of one incoming LCM channel: not too many, and, where a key is given, only what carries its tag.
///
/// Order    rate first, so that a flood costs no hashing; then tag; decoding is the caller's next step.
/// Time     `now` on any steady clock, `utc_ns` UTC of this host.
/// Threads  one at a time. Memory: none in step().
#include <optional>

#include "base/time.hpp"
#include "wire/signed.hpp"

namespace cyclops {

/// Tokens for `burst` messages, refilled at `rate_hz`.
class RateLimit {
 public:
  RateLimit(double rate_hz, double burst) : price_ns_(static_cast<std::int64_t>(1e9 / rate_hz)), most_ns_(static_cast<std::int64_t>(1e9 / rate_hz * burst)), credit_ns_(most_ns_) {}
  [[nodiscard]] bool pass(Time now);

 private:
  std::int64_t price_ns_;
  std::int64_t most_ns_;
  std::int64_t credit_ns_;
  std::optional<Time> last_{};
};

struct LinkGateConfig {
  double rate_hz{500};
  double burst{500};
  std::optional<Key> key{};         ///< none: plain messages are taken, signed ones are not listened to
  Duration freshness = Duration::from_seconds(2);
};

struct LinkGateCounters {
  std::uint64_t received{0};
  std::uint64_t flooded{0};         ///< beyond the rate
  std::uint64_t not_authentic{0};   ///< plain although a key is given; damaged; wrong tag or channel
  std::uint64_t replayed{0};        ///< authentic, but not fresh or not for the first time
};

class LinkGate {
 public:
  LinkGate(std::string channel, LinkGateConfig config);
  /// `wrapped`: came on the SIGNED_ channel. The message to decode, a view into `data`.
  /// Errors: kFull for a flood, else as Verifier::open.
  [[nodiscard]] Result<std::span<const std::uint8_t>> step(bool wrapped, const void* data, std::size_t size, Time now, std::int64_t utc_ns);
  [[nodiscard]] const LinkGateCounters& counters() const { return counters_; }
  [[nodiscard]] const std::string& channel() const { return channel_; }
  [[nodiscard]] bool needs_tag() const { return verifier_.has_value(); }

 private:
  std::string channel_;
  RateLimit limit_;
  RateLimit plain_limit_;           // plain messages must not use up the room of signed ones
  std::optional<Verifier> verifier_;
  LinkGateCounters counters_{};
};

}  // namespace cyclops
