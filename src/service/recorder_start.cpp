// How a recording begins: the folder, what is known by then, the threads.
#include <pthread.h>

#include <ctime>
#include <filesystem>

#include "base/file.hpp"
#include "service/pipeline_state.hpp"
#include "service/recorder.hpp"

namespace cyclops {
namespace fs = std::filesystem;
namespace {

std::string utc(std::int64_t realtime_ns, const char* format) {
  const std::time_t s = realtime_ns / 1'000'000'000;
  std::tm parts{};
  gmtime_r(&s, &parts);
  char text[40];
  return {text, std::strftime(text, sizeof text, format, &parts)};
}

std::int64_t realtime_ns() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

/// rig.toml with the names its files have in the sortie, and those files.
Result<std::vector<record::SortieFile>> rig_files(const Rig& rig) {
  auto text = read_file(rig.path);
  if (!text.ok()) return text.error();
  std::vector<record::SortieFile> out;
  for (const RigFile& f : rig.files) {
    auto content = read_file(f.path);
    if (!content.ok()) return content.error();
    const std::string name = fs::path(f.path).filename().string();
    out.push_back({name, std::move(content).value()});
    bool found = name == f.as_written;
    for (const char quote : {'"', '\''}) {
      const std::string old = quote + f.as_written + quote;
      if (const auto at = text->find(old); !found && at != std::string::npos) {
        text->replace(at, old.size(), quote + name + quote);
        found = true;
      }
    }
    if (!found) return make_error(ErrorCode::kUnsupported, rig.path, "writes the path " + f.as_written + " so that it cannot be copied; expected plain quotes");
  }
  out.push_back({"rig.toml", *text});
  return out;
}

}  // namespace

Result<std::unique_ptr<Recorder>> Recorder::start(const RecordOptions& options, const Rig& rig, const std::string& profile_name, const std::string& profile_path,
                                                  bool own_clock, EventBus& events) {
  auto files = rig_files(rig);
  if (!files.ok()) return files.error();
  if (!profile_path.empty()) {
    auto text = read_file(profile_path);
    if (!text.ok()) return text.error();
    files->push_back({"profile.toml", std::move(text).value()});
  }
  auto program = read_file("/proc/self/exe");
  if (!program.ok()) return program.error();
  record::SortieHead head;
  head.started_realtime_ns = realtime_ns();
  head.started_monotonic_ns = host_now_ns();
  head.started_utc = utc(head.started_realtime_ns, "%Y-%m-%dT%H:%M:%SZ");
  head.name = options.name.empty() ? utc(head.started_realtime_ns, "%Y%m%dT%H%M%SZ") : options.name;
  head.version = CYCLOPS_VERSION;
  head.program_sha256 = record::sha256(*program);
  head.profile = profile_name;
  head.own_clock = own_clock;
  const std::string folder = (fs::path(options.folder) / head.name).string();
  CYCLOPS_TRY(record::begin_sortie(folder, head, *files));
  if (auto copy = Rig::load((fs::path(folder) / "rig.toml").string()); !copy.ok()) return copy.error();
  std::unique_ptr<Recorder> r(new Recorder(options, rig, events, own_clock));
  r->folder_ = folder;
  r->name_ = head.name;
  r->source_ = "cyclops " + head.version + ", profile " + head.profile + ", " + head.started_utc;
  CYCLOPS_TRY(r->open(folder));
  return r;
}

Result<> Recorder::open(const std::string& folder) {
  record::LogStreamConfig config;
  config.folder = folder;
  config.split_bytes = options_.split_bytes;
  config.split_time = Duration::from_seconds(options_.split_s);
  for (const auto& [name, stream] : {std::pair{record::kInputs, &inputs_.stream}, std::pair{record::kPublished, &published_.stream}, std::pair{record::kFrames, &frames_}}) {
    config.name = name;
    auto created = record::LogStream::create(config);
    if (!created.ok()) return created.error();
    *stream = std::move(created).value();
  }
  look_at_room();
  log_thread_ = std::thread(&Recorder::run_log, this);
  frames_thread_ = std::thread(&Recorder::run_frames, this);
  sync_thread_ = std::thread(&Recorder::run_sync, this);
  pthread_setname_np(log_thread_.native_handle(), "rec-log");
  pthread_setname_np(frames_thread_.native_handle(), "rec-frames");
  pthread_setname_np(sync_thread_.native_handle(), "rec-sync");
  return Ok{};
}

}  // namespace cyclops
