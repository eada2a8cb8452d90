#include "service/link.hpp"

#include <algorithm>

#include "base/clock.hpp"
#include "wire/codec.hpp"

namespace cyclops {
namespace {

struct Rate {
  const char* channel;
  double rate_hz, burst;
  int queue;                 // messages that LCM may keep for us
};
// By Link. TSPI: the guard's 400 a second and some more, so that the guard, which replays alike, is what refuses.
constexpr Rate kRates[kLinks] = {{channel::kTspiReceiver, 500, 500, 256}, {channel::kTspiTanker, 500, 500, 256}, {channel::kTimeMark, 10, 20, 64}, {channel::kMark, 5, 10, 16}};

bool power_of_two(std::uint64_t n) { return (n & (n - 1)) == 0; }

/// "tspi.refused", "time_mark.flood" ...
std::string event_code(Link link, const Error& error, bool undecodable) {
  const char* cause = undecodable ? "refused" : error.code == ErrorCode::kFull ? "flood" : error.code == ErrorCode::kTimeout ? "replayed" : "not_authentic";
  const char* what = link == Link::kTimeMark ? "time_mark." : link == Link::kMark ? "mark." : "tspi.";
  return std::string(what) + cause;
}

}  // namespace

const char* to_string(Link link) {
  switch (link) {
    case Link::kReceiver: return "tspi.receiver";
    case Link::kTanker: return "tspi.tanker";
    case Link::kTimeMark: return "time_mark";
    case Link::kMark: return "mark";
  }
  return "unknown";
}

LinkDoors::LinkDoors(Pipeline::State& s) : s_(s) {
  for (std::size_t l = 0; l < kLinks; ++l) {
    const Link link = static_cast<Link>(l);
    LinkGateConfig config;
    config.rate_hz = kRates[l].rate_hz;
    config.burst = kRates[l].burst;
    config.key = s_.options.key;
    doors_[l].emplace(Door{this, link, LinkGate(kRates[l].channel, config)});
  }
}

void LinkDoors::open(lcm_t* lcm) {
  for (std::size_t l = 0; l < kLinks; ++l) {
    if (!doors_[l]) continue;
    const std::string plain = kRates[l].channel;
    lcm_subscription_set_queue_capacity(lcm_subscribe(lcm, plain.c_str(), on_message, &*doors_[l]), kRates[l].queue);
    if (doors_[l]->gate.needs_tag())
      lcm_subscription_set_queue_capacity(lcm_subscribe(lcm, (channel::kSignedPrefix + plain).c_str(), on_message, &*doors_[l]), kRates[l].queue);
  }
}

void LinkDoors::on_message(const lcm_recv_buf_t* buffer, const char* name, void* door) {
  Door& d = *static_cast<Door*>(door);
  d.owner->take(d, std::string_view(name).starts_with(channel::kSignedPrefix), *buffer);
}

void LinkDoors::take(Door& door, bool wrapped, const lcm_recv_buf_t& buffer) {
  const auto message = door.gate.step(wrapped, buffer.data, buffer.data_size, Time{host_now_ns()}, utc_now_ns());
  {
    const LinkGateCounters& c = door.gate.counters();
    const std::lock_guard lock(s_.counts_mutex);
    LinkCounts& counts = s_.link_counts[static_cast<std::size_t>(door.link)];
    counts.received = c.received;
    counts.flooded = c.flooded;
    counts.not_authentic = c.not_authentic;
    counts.replayed = c.replayed;
  }
  if (!message.ok()) return refused(door, message.error(), false);
  if (const auto done = decode(door.link, *message); !done.ok()) refused(door, done.error(), true);
}

Result<> LinkDoors::decode(Link link, std::span<const std::uint8_t> m) {
  if (link == Link::kTimeMark) {
    auto mark = decode_time_mark(m.data(), m.size());
    if (!mark.ok()) return mark.error();
    s_.offer(TimeMark(mark->mark));
  } else if (link == Link::kMark) {
    const auto mark = decode_mark(m.data(), m.size());
    if (!mark.ok()) return mark.error();
    s_.events.post(s_.service_now(), EventLevel::kMark, "mark", "mark", std::string(mark->text), mark->seq);
  } else {
    auto report = decode_tspi(m.data(), m.size(), link == Link::kReceiver ? Aircraft::kReceiver : Aircraft::kTanker);
    if (!report.ok()) return report.error();
    ArrivedTspi tspi{*report, Time{host_now_ns() / 1000 * 1000}, {}};
    tspi.bytes.resize(m.size());
    std::copy(m.begin(), m.end(), tspi.bytes.begin());
    s_.offer(std::move(tspi));
  }
  return Ok{};
}

void LinkDoors::refused(Door& door, const Error& error, bool undecodable) {
  const auto l = static_cast<std::size_t>(door.link);
  if (undecodable) {
    const std::lock_guard lock(s_.counts_mutex);
    ++s_.link_counts[l].refused;
  }
  if (const std::uint64_t n = ++refusals_[l]; power_of_two(n))  // 1, 2, 4, 8 ...
    s_.events.post(s_.service_now(), EventLevel::kWarning, "link", event_code(door.link, error, undecodable).c_str(), error.message(), static_cast<std::int64_t>(n));
}

void Pipeline::State::run_link() {
  while (!stopping)
    if (lcm_handle_timeout(lcm, 100) < 0) {
      events.post(service_now(), EventLevel::kFault, "link", "lcm.failed", "lcm_handle_timeout failed");
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
}

}  // namespace cyclops
