#include <algorithm>
#include <filesystem>
#include <functional>
#include <set>

#include "base/file.hpp"
#include "record/flight.hpp"
#include "record/log_stream.hpp"
#include "record/whole_file.hpp"
#include "tools/sortie_check.hpp"
#include "tools/sortie_copy.hpp"
#include "wire/codec.hpp"

namespace cyclops::tools {
namespace fs = std::filesystem;
namespace {

using record::LogEvent;

bool within(const std::vector<record::Range>& ranges, std::int64_t n) {
  return std::any_of(ranges.begin(), ranges.end(), [n](const record::Range& r) { return n >= r.from && n < r.to; });
}

class Recovery {
 public:
  Recovery(const std::string& from, const std::string& to, SortieReport report) : from_(from), to_(to), report_(std::move(report)) {}

  Result<Copied> run() {
    CYCLOPS_TRY(copy_texts());
    CYCLOPS_TRY(copy(record::kInputs, [this](const LogEvent& e) { return input(e); }));
    CYCLOPS_TRY(copy(record::kPublished, [this](const LogEvent& e) { return published(e); }));
    CYCLOPS_TRY(copy(record::kFrames, [this](const LogEvent& e) { return pixels(e); }));
    FlightManifest m;
    m.name = report_.head.name;
    m.origin = "recorded";
    m.source = "recovered, Cyclops " + report_.head.version + ", profile " + report_.head.profile + ", " + report_.head.started_utc;
    m.frames = out_.frames;
    m.pixels = out_.pixels;
    m.first_frame_ns = first_t_mid_;
    m.last_frame_ns = last_t_mid_;
    CYCLOPS_TRY(write_manifest(to_, m));
    return out_;
  }

 private:
  Result<> copy_texts() {
    std::error_code error;
    if (!fs::create_directories(to_, error)) return make_error(error ? ErrorCode::kIo : ErrorCode::kInvalid, to_, error ? error.message() : "is there already");
    for (const auto& entry : fs::directory_iterator(from_, error)) {
      const std::string name = entry.path().filename().string(), end = entry.path().extension().string();
      if (!entry.is_regular_file() || end == ".lcm" || end == ".part" || name == "manifest.toml") continue;
      auto text = read_file(entry.path().string());
      if (!text.ok()) return text.error();
      CYCLOPS_TRY(record::write_whole((fs::path(to_) / name).string(), *text));
    }
    if (error) return make_error(ErrorCode::kIo, from_, error.message());
    return Ok{};
  }

  Result<> copy(const char* name, const std::function<bool(const LogEvent&)>& wanted) {
    record::LogStreamConfig config;
    config.folder = to_;
    config.name = name;
    auto stream = record::LogStream::create(config);
    if (!stream.ok()) return stream.error();
    Result<> done = Ok{};
    Time last{};
    for (const std::string& part : log_parts(from_, name)) {
      auto scan = record::scan_log(part, [&](const LogEvent& e) {
        if (!done.ok() || !wanted(e)) return;
        std::uint8_t head[record::kEventHeadBytes + record::kMaxChannelBytes];
        const std::size_t n = record::put_event_head(head, e.number, e.time_us, e.channel.c_str(), e.data.size());
        last = Time{e.time_us * 1000};
        done = (*stream)->write(last, {{head, n}, e.data});
      });
      if (!scan.ok()) return scan.error();
      CYCLOPS_TRY(std::move(done));
      done = Ok{};
    }
    return (*stream)->close(last);
  }

  bool input(const LogEvent& e) {
    ++out_.inputs;
    if (e.channel != channel::kFrame) return true;
    const auto f = decode_frame_index(e.data.data(), e.data.size());
    if (!f.ok()) return false;
    ++out_.frames;
    used_.insert(f->recorded_at);
    return true;
  }

  bool published(const LogEvent& e) {
    ++out_.published;
    if (e.channel != channel::kFrame) return true;
    const auto f = decode_frame_index(e.data.data(), e.data.size());
    if (!f.ok() || f->info.time_source == TimeSource::kUnknown) return true;
    if (first_t_mid_ == 0) first_t_mid_ = f->info.t_mid.ns;
    last_t_mid_ = f->info.t_mid.ns;
    return true;
  }

  bool pixels(const LogEvent& e) {
    if (e.channel != channel::kFrameData || used_.count(e.number) == 0 || within(report_.damaged_frames, e.number)) return false;
    if (!decode_frame_data(e.data.data(), e.data.size()).ok()) return false;
    ++out_.pixels;
    return true;
  }

  std::string from_, to_;
  SortieReport report_;
  Copied out_;
  std::set<std::int64_t> used_;
  std::int64_t first_t_mid_{0}, last_t_mid_{0};
};

}  // namespace

Result<Copied> recover_sortie(const std::string& folder, const std::string& out) {
  auto report = check_sortie(folder);
  if (!report.ok()) return report.error();
  if (!report->sortie) return make_error(ErrorCode::kUnsupported, folder, "was not recorded by the service: sortie.toml is missing");
  return Recovery(folder, out, std::move(report).value()).run();
}

}  // namespace cyclops::tools
