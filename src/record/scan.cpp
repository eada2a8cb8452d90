#include "record/scan.hpp"

#include <xxhash.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "wire/codec.hpp"

namespace cyclops::record {
namespace {

struct CloseFile { void operator()(std::FILE* f) const { std::fclose(f); } };
using File = std::unique_ptr<std::FILE, CloseFile>;

/// The first byte at or after `from` where a sync word stands; the file's size when there is none.
std::int64_t next_sync(std::FILE* f, std::int64_t from, std::int64_t size) {
  static constexpr std::uint8_t kSync[4] = {0xED, 0xA1, 0xDA, 0x01};
  std::vector<std::uint8_t> block(std::size_t{1} << 16);
  for (std::int64_t at = from; at < size;) {
    if (fseeko(f, at, SEEK_SET) != 0) return size;
    const std::size_t n = std::fread(block.data(), 1, block.size(), f);
    if (n < sizeof kSync) return size;
    const auto hit = std::search(block.begin(), block.begin() + static_cast<std::ptrdiff_t>(n), std::begin(kSync), std::end(kSync));
    if (hit != block.begin() + static_cast<std::ptrdiff_t>(n)) return std::min(size, at + (hit - block.begin()));
    at += static_cast<std::int64_t>(n - sizeof kSync + 1);
  }
  return size;
}

bool sum_is(std::FILE* f, const Seal& seal) {
  std::vector<std::uint8_t> block(std::size_t{1} << 20);
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), XXH3_freeState);
  XXH3_64bits_reset(state.get());
  if (fseeko(f, seal.from, SEEK_SET) != 0) return false;
  for (std::int64_t left = seal.to - seal.from; left > 0;) {
    const std::size_t n = std::fread(block.data(), 1, static_cast<std::size_t>(std::min<std::int64_t>(left, static_cast<std::int64_t>(block.size()))), f);
    if (n == 0) return false;
    XXH3_64bits_update(state.get(), block.data(), n);
    left -= static_cast<std::int64_t>(n);
  }
  return XXH3_64bits_digest(state.get()) == seal.sum;
}

void count(LogScan& s, const LogEvent& e) {
  ChannelScan& c = s.channels[e.channel];
  if (c.events++ == 0) c.first_us = e.time_us;
  c.last_us = e.time_us;
  c.bytes += static_cast<std::int64_t>(e.data.size());
  if (s.events++ == 0) s.first_us = e.time_us;
  s.last_us = e.time_us;
}

}  // namespace

Result<LogScan> scan_log(const std::string& path, const std::function<void(const LogEvent&)>& see) {
  auto log = EventLog::open(path);
  if (!log.ok()) return log.error();
  const File raw(std::fopen(path.c_str(), "rb"));
  if (!raw) return make_error(ErrorCode::kIo, path, "cannot be opened twice");
  LogScan s;
  s.path = path;
  s.bytes = log->size();
  LogEvent event;
  Range before;  // the event read last
  while (true) {
    auto more = log->next(event);
    if (!more.ok()) {
      // A length that is too large swallows what follows: then a sync word stands inside the event before.
      const std::int64_t inside = before.to == event.offset ? next_sync(raw.get(), before.from + 4, before.to) : before.to;
      if (inside < before.to) {
        before = {};
        CYCLOPS_TRY(log->seek(inside));
        continue;
      }
      const std::int64_t next = next_sync(raw.get(), event.offset + 1, s.bytes);
      if (next == s.bytes && more.error().code == ErrorCode::kTruncated) {
        s.tail_bytes = s.bytes - event.offset;
        break;
      }
      s.unreadable.push_back({event.offset, next});
      CYCLOPS_TRY(log->seek(next));
      continue;
    }
    if (!*more) break;
    before = {event.offset, event.offset + static_cast<std::int64_t>(kEventHeadBytes + event.channel.size() + event.data.size())};
    if (event.channel != channel::kSeal) {
      count(s, event);
      if (see) see(event);
      continue;
    }
    ++s.seals;
    const auto seal = decode_seal(event.data.data(), event.data.size());
    if (!seal.ok() || seal->to != event.offset || seal->from > seal->to) {
      s.damaged.push_back({event.offset, event.offset});
      continue;
    }
    s.sealed_to = seal->to;
    if (!sum_is(raw.get(), *seal)) s.damaged.push_back({seal->from, seal->to});
  }
  return s;
}

}  // namespace cyclops::record
