#include "tools/log_diff.hpp"

#include <array>
#include <filesystem>
#include <map>
#include <vector>

#include "record/event_log.hpp"
#include "record/flight.hpp"
#include "record/sortie.hpp"
#include "wire/channels.hpp"

namespace cyclops::tools {
namespace {

constexpr std::array<const char*, 6> kStagesInOrder{channel::kNav, channel::kPrediction, channel::kSubImage, channel::kCorner, channel::kTrack, channel::kMeasurement};
constexpr std::size_t kHeader = 24;  // fingerprint, seq, mid_exposure_ns: the same in all six types

std::int64_t big_endian(const std::uint8_t* p) {
  std::uint64_t v = 0;
  for (int i = 0; i < 8; ++i) v = v << 8 | p[i];
  return static_cast<std::int64_t>(v);
}

struct Frame {
  std::int64_t seq{0};
  std::array<std::vector<std::uint8_t>, kStagesInOrder.size()> payload;
};
using Frames = std::map<std::int64_t, Frame>;

/// Of one file, or of the parts of a sortie's log.
Result<> read_one(const std::string& path, bool by_seq, Frames& out) {
  auto log = record::EventLog::open(path);
  if (!log.ok()) return log.error();
  record::LogEvent event;
  while (true) {
    auto more = log->next(event);
    if (!more.ok()) return more.error();
    if (!*more) break;
    for (std::size_t s = 0; s < kStagesInOrder.size(); ++s) {
      if (event.channel != kStagesInOrder[s] || event.data.size() < kHeader) continue;
      Frame& f = out[big_endian(event.data.data() + (by_seq ? 8 : 16))];
      f.seq = big_endian(event.data.data() + 8);
      f.payload[s] = event.data;
    }
  }
  return Ok{};
}

Result<Frames> read(const std::string& path, bool by_seq) {
  Frames out;
  const std::filesystem::path p(path);
  std::error_code ignored;
  const bool folder = std::filesystem::is_directory(p, ignored);
  std::vector<std::string> parts = folder ? log_parts(path, record::kPublished) : log_parts(p.parent_path().empty() ? "." : p.parent_path().string(), p.stem().string());
  if (parts.empty()) parts.push_back(folder ? (p / "published.lcm").string() : path);
  for (const std::string& part : parts) CYCLOPS_TRY(read_one(part, by_seq, out));
  std::erase_if(out, [](const auto& item) { return item.second.payload.back().empty(); });
  return out;
}

}  // namespace

Result<LogDiff> diff_logs(const std::string& path_a, const std::string& path_b, const DiffOptions& options) {
  auto a = read(path_a, options.by_seq);
  if (!a.ok()) return a.error();
  auto b = read(path_b, options.by_seq);
  if (!b.ok()) return b.error();
  if (options.before > 0)
    for (Frames* frames : {&*a, &*b}) std::erase_if(*frames, [&](const auto& item) { return item.second.seq >= options.before; });
  LogDiff d;
  d.frames_a = static_cast<std::int64_t>(a->size());
  d.frames_b = static_cast<std::int64_t>(b->size());
  const char* absent = options.by_seq ? "timesync (no frame of this number in the other log)" : "timesync (no frame at this time in the other log)";
  const auto note = [&](std::int64_t seq, const std::string& stage) {
    if (d.first_frame_seq >= 0) return;
    d.first_frame_seq = seq;
    d.first_stage = stage;
  };
  for (const auto& [t, fa] : *a) {
    const auto it = b->find(t);
    if (it == b->end()) {
      if (options.heard) continue;
      ++d.only_a;
      note(fa.seq, absent);
      continue;
    }
    bool same = true;
    for (std::size_t s = 0; s < kStagesInOrder.size() && same; ++s)
      if (fa.payload[s] != it->second.payload[s] && !(options.heard && it->second.payload[s].empty())) {
        same = false;
        note(fa.seq, kStagesInOrder[s]);
      }
    ++(same ? d.equal : d.different);
  }
  for (const auto& [t, fb] : *b)
    if (a->find(t) == a->end()) {
      ++d.only_b;
      note(fb.seq, absent);
    }
  return d;
}

}  // namespace cyclops::tools
