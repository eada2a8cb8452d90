#include "tools/sortie_check.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>

#include "base/file.hpp"
#include "record/flight.hpp"
#include "wire/codec.hpp"

namespace cyclops::tools {
namespace fs = std::filesystem;
namespace {

using record::LogEvent;
using record::Range;

/// Numbers that should follow each other.
class Follow {
 public:
  void see(std::int64_t n) {
    if (last_ && n > *last_ + 1) missing_ += n - *last_ - 1;
    if (!last_ || n > *last_) last_ = n;
  }
  void begin_anew() { last_.reset(); }
  [[nodiscard]] std::int64_t missing() const { return missing_; }

 private:
  std::optional<std::int64_t> last_;
  std::int64_t missing_{0};
};

void add(std::vector<Range>& ranges, std::int64_t n) {
  if (!ranges.empty() && ranges.back().to == n) ++ranges.back().to;
  else ranges.push_back({n, n + 1});
}

class Check {
 public:
  explicit Check(const std::string& folder) : folder_(folder) {}

  Result<SortieReport> run() {
    std::error_code ignored;
    r_.sortie = fs::exists(fs::path(folder_) / "sortie.toml", ignored);
    r_.finished = fs::exists(fs::path(folder_) / "manifest.toml", ignored);
    if (!r_.sortie && !r_.finished) return make_error(ErrorCode::kNotFound, folder_, "is no sortie and no flight: neither sortie.toml nor manifest.toml is there");
    if (r_.sortie) CYCLOPS_TRY(head());
    CYCLOPS_TRY(log(record::kInputs, r_.inputs, [this](const LogEvent& e) { input(e); }));
    if (r_.sortie) CYCLOPS_TRY(log(record::kPublished, r_.published, [this](const LogEvent& e) { published(e); }));
    CYCLOPS_TRY(log(record::kFrames, r_.frames, [this](const LogEvent& e) { pixels(e); }));
    match_frames();
    if (r_.finished) manifest();
    else problem("the sortie was not finished: no manifest.toml");
    if (camera_.missing() > 0) note(std::to_string(camera_.missing()) + " numbers of the camera never reached the chain");
    for (int a = 0; a < 2; ++a)
      if (tspi_[a].missing() > 0) note(std::to_string(tspi_[a].missing()) + " messages of " + channel::tspi(static_cast<Aircraft>(a)) + " never came");
    if (measurements_.missing() > 0) problem(std::to_string(measurements_.missing()) + " frames are missing among the published measurements");
    return std::move(r_);
  }

 private:
  void problem(const std::string& what) { r_.problems.push_back(what); }
  void note(const std::string& what) { r_.notes.push_back(what); }

  Result<> head() {
    auto head = record::read_sortie(folder_);
    if (!head.ok()) return problem(head.error().message()), Result<>(Ok{});
    r_.head = *head;
    for (const auto& [name, sum] : head->sha256) {
      const auto text = read_file((fs::path(folder_) / name).string());
      if (!text.ok()) problem(text.error().message());
      else if (record::sha256(*text) != sum) problem(name + " is not what it was when the sortie began (SHA-256)");
    }
    return Ok{};
  }

  Result<> log(const char* name, LogReport& out, const std::function<void(const LogEvent&)>& see) {
    out.name = name;
    const std::vector<std::string> parts = log_parts(folder_, name);
    if (parts.empty()) problem(std::string(name) + ".lcm is missing");
    Follow numbers;
    const bool numbered = r_.sortie && std::string(name) != record::kFrames;  // pixels may come in another order
    for (const std::string& path : parts) {
      auto scan = record::scan_log(path, [&](const LogEvent& e) {
        if (numbered) numbers.see(e.number);
        see(e);
      });
      if (!scan.ok()) return scan.error();
      say(*scan, path == parts.back());
      out.events += scan->events;
      out.parts.push_back(std::move(scan).value());
    }
    out.lost_events = numbers.missing();
    if (out.lost_events > 0) problem(std::string(name) + ": " + std::to_string(out.lost_events) + " events are missing by their numbers");
    return Ok{};
  }

  void say(const record::LogScan& s, bool last) {
    const std::string file = fs::path(s.path).filename().string();
    for (const Range& r : s.unreadable) problem(file + ": bytes " + std::to_string(r.from) + " to " + std::to_string(r.to) + " hold no event");
    for (const Range& r : s.damaged) problem(file + ": bytes " + std::to_string(r.from) + " to " + std::to_string(r.to) + " do not have their checksum");
    if (s.tail_bytes > 0) problem(file + ": ends inside an event, " + std::to_string(s.tail_bytes) + " bytes of it are there");
    if (r_.sortie && r_.finished && last && s.events > 0 && s.seals == 0) problem(file + ": has no seal");
  }

  void input(const LogEvent& e) {
    if (e.channel == channel::kFrame) {
      const auto f = decode_frame_index(e.data.data(), e.data.size());
      if (!f.ok()) return problem(f.error().message());
      ++r_.frames_used;
      if (f->info.camera_frame_id != 0) camera_.see(static_cast<std::int64_t>(f->info.camera_frame_id));
      used_.push_back(f->recorded_at);
    } else if (e.channel == channel::kAcquisition) {
      const auto a = decode_acquisition(e.data.data(), e.data.size());
      if (!a.ok()) return problem(a.error().message());
      if (a->what == AcquisitionChange::kStarted) camera_.begin_anew();
    } else if (e.channel == channel::kTspiReceiver || e.channel == channel::kTspiTanker) {
      const Aircraft a = e.channel == channel::kTspiReceiver ? Aircraft::kReceiver : Aircraft::kTanker;
      const auto t = decode_tspi(e.data.data(), e.data.size(), a);
      if (!t.ok()) return problem(t.error().message());
      tspi_[static_cast<int>(a)].see(t->seq);
    }
  }

  void published(const LogEvent& e) {
    if (e.channel != channel::kMeasurement || e.data.size() < 16) return;
    std::int64_t seq = 0;
    for (int i = 8; i < 16; ++i) seq = seq << 8 | e.data[static_cast<std::size_t>(i)];
    measurements_.see(seq);
  }

  void pixels(const LogEvent& e) {
    if (e.channel != channel::kFrameData) return;
    const auto f = decode_frame_data(e.data.data(), e.data.size());
    if (!f.ok()) return problem("frame " + std::to_string(e.number) + ": " + f.error().message());
    there_.insert(e.number);
    places_.push_back({e.number, r_.frames.parts.size(), e.offset});
  }

  void match_frames() {
    for (const Place& p : places_)
      for (const Range& bad : r_.frames.parts[p.part].damaged)
        if (p.offset >= bad.from && p.offset < bad.to) {
          add(r_.damaged_frames, p.number);
          there_.erase(p.number);
        }
    for (const std::int64_t n : used_)
      if (there_.count(n) == 0) add(r_.without_pixels, n);
    r_.frames_there = static_cast<std::int64_t>(there_.size());
    if (!r_.damaged_frames.empty()) problem("pixels damaged: frames " + text_of(r_.damaged_frames));
    std::int64_t without = 0;
    for (const Range& x : r_.without_pixels) without += x.to - x.from;
    if (without > 0) problem(std::to_string(without) + " frames have no pixels: " + text_of(r_.without_pixels));
  }

  void manifest() {
    if (const auto flight = FlightReader::open(folder_); !flight.ok()) problem(flight.error().message());
  }

  struct Place {
    std::int64_t number{0};
    std::size_t part{0};
    std::int64_t offset{0};
  };
  std::string folder_;
  SortieReport r_;
  Follow camera_, tspi_[2], measurements_;
  std::vector<std::int64_t> used_;
  std::set<std::int64_t> there_;
  std::vector<Place> places_;
};

void print(const LogReport& log) {
  if (log.parts.empty()) return;
  std::printf("%s: %zu file%s, %.1f MB, %lld events, %.2f s, %.2f MB/s\n", log.name.c_str(), log.parts.size(), log.parts.size() == 1 ? "" : "s", static_cast<double>(log.bytes()) * 1e-6,
              static_cast<long long>(log.events), log.seconds(), log.seconds() > 0 ? static_cast<double>(log.bytes()) * 1e-6 / log.seconds() : 0.0);
  std::map<std::string, record::ChannelScan> sums;
  for (const auto& part : log.parts)
    for (const auto& [name, c] : part.channels) {
      record::ChannelScan& s = sums[name];
      if (s.events == 0) s.first_us = c.first_us;
      s.events += c.events;
      s.bytes += c.bytes;
      s.last_us = c.last_us;
    }
  for (const auto& [name, c] : sums)
    std::printf("  %-16s %8lld events %13lld bytes %8.1f Hz\n", name.c_str(), static_cast<long long>(c.events), static_cast<long long>(c.bytes),
                c.last_us > c.first_us ? static_cast<double>(c.events - 1) * 1e6 / static_cast<double>(c.last_us - c.first_us) : 0.0);
}

}  // namespace

std::int64_t LogReport::bytes() const {
  std::int64_t sum = 0;
  for (const auto& part : parts) sum += part.bytes;
  return sum;
}

double LogReport::seconds() const {
  std::int64_t first = 0, last = 0;
  for (const auto& part : parts) {
    if (part.events == 0) continue;
    if (first == 0) first = part.first_us;
    last = part.last_us;
  }
  return static_cast<double>(last - first) * 1e-6;
}

std::string text_of(const std::vector<Range>& ranges) {
  std::string out;
  for (std::size_t i = 0; i < ranges.size() && i < 8; ++i) {
    const Range& r = ranges[i];
    out += (i > 0 ? ", " : "") + std::to_string(r.from) + (r.to > r.from + 1 ? " to " + std::to_string(r.to - 1) : "");
  }
  return out + (ranges.size() > 8 ? " ... (" + std::to_string(ranges.size()) + " ranges)" : "");
}

Result<SortieReport> check_sortie(const std::string& folder) { return Check(folder).run(); }

void print_info(const SortieReport& r) {
  if (r.sortie)
    std::printf("sortie %s, %s, begun %s, Cyclops %s, profile %s%s\n", r.head.name.c_str(), r.finished ? "finished" : "NOT finished", r.head.started_utc.c_str(), r.head.version.c_str(),
                r.head.profile.c_str(), r.head.own_clock ? ", clock of a bench" : "");
  print(r.inputs);
  print(r.published);
  print(r.frames);
  std::printf("%lld frames went into the chain, %lld have their pixels\n", static_cast<long long>(r.frames_used), static_cast<long long>(r.frames_there));
  for (const std::string& n : r.notes) std::printf("  %s\n", n.c_str());
}

}  // namespace cyclops::tools
