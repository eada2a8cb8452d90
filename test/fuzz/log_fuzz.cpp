// sources: src/record src/wire src/base
// Any bytes as an event log, then as the two logs and the manifest of a flight. What is read whole must be the same when it
// is skimmed, and must come back when it is written.
#include <filesystem>

#include "record/flight.hpp"
#include "test/fuzz/memory_file.hpp"

using namespace cyclops;  // NOLINT

namespace {

void must(bool good) {
  if (!good) std::abort();
}

/// How many events it has; -1 when it is no log.
std::int64_t try_log(const std::string& path, std::size_t size) {
  auto read = record::EventLog::open(path), skim = record::EventLog::open(path);
  must(read.ok() && skim.ok());
  record::LogEvent a, b;
  for (std::int64_t sum = 0, events = 0;; ++events) {
    std::uint32_t bytes = 0;
    const auto more = read->next(a), again = skim->skim(b, bytes);
    must(more.ok() == again.ok() || (more.ok() && *more) == false);
    must(a.data.capacity() <= 2 * size + 64);  // no memory on the word of a length
    if (!more.ok()) {
      must(!more.error().what.empty());
      return -1;
    }
    if (!*more) {
      must(sum == static_cast<std::int64_t>(size));
      return events;
    }
    must(*again && a.offset == b.offset && a.channel == b.channel && bytes == a.data.size());
    sum += 28 + static_cast<std::int64_t>(a.channel.size() + a.data.size());
    must(sum <= static_cast<std::int64_t>(size));
  }
}

/// A flight whose files are all in memory: both logs are the input, and nothing is made or removed for one.
struct Folder {
  std::string path;
  fuzz::MemoryFile manifest{"manifest"}, rig{"rig"};
  explicit Folder(const fuzz::MemoryFile& log) {
    char name[] = "/tmp/cyclops-fuzz-XXXXXX";
    must(mkdtemp(name) != nullptr);
    path = name;
    link("messages.lcm", log);
    link("frames.lcm", log);
    link("manifest.toml", manifest);
    link("rig.toml", rig);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  void link(const char* name, const fuzz::MemoryFile& file) const { std::filesystem::create_symlink(file.path(), path + "/" + name); }
};

void try_flight(Folder& folder, std::size_t size, std::int64_t frames, const std::uint8_t* data, bool own_manifest) {
  const std::string n = std::to_string(size);
  const std::string manifest = "format = \"cyclops-flight-1\"\nframes = " + std::to_string(frames) + "\n[files]\n\"messages.lcm\" = " + n + "\n\"frames.lcm\" = " + n + "\n\"rig.toml\" = 0\n";
  if (own_manifest) (void)folder.manifest.holding(data, size);
  else (void)folder.manifest.holding(reinterpret_cast<const std::uint8_t*>(manifest.data()), manifest.size());
  auto flight = FlightReader::open(folder.path);
  if (!flight.ok()) return must(!flight.error().message().empty());
  record::LogEvent event;
  while (true) {
    const auto more = flight->next(event);
    if (!more.ok() || !*more) break;
  }
  (void)flight->seek(Time{static_cast<std::int64_t>(size) * 1000}).ok();
  std::vector<std::uint8_t> memory;
  FlightFrame frame;
  std::uint64_t sum = 0;
  for (std::int64_t i = -1; i <= frames; ++i)
    if (flight->frame(i, memory, frame).ok() && frame.image.data != nullptr)
      for (int v = 0; v < frame.image.height; ++v) sum += frame.image.row8(v)[frame.image.width * bytes_per_pixel(frame.image.format) - 1];
  static volatile std::uint64_t keep;
  keep = sum;
  (void)keep;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::MemoryFile file("log");
  static Folder folder(file);
  const std::int64_t frames = try_log(file.holding(data, size), size);
  if (frames > 0) try_flight(folder, size, frames, data, false);
  if (size > 0 && size < 600 && (data[0] == 'f' || data[0] == '[' || data[0] == '#')) try_flight(folder, size, 1, data, true);
  return 0;
}
