#include <cstdio>
#include <map>

#include <CLI/CLI.hpp>

#include "record/event_log.hpp"
#include "tools/log_diff.hpp"
#include "tools/offline.hpp"

namespace {

int fail(const cyclops::Error& error) {
  std::fprintf(stderr, "cyclops-log: %s\n", error.message().c_str());
  return 1;
}

int info(const std::string& path) {
  auto log = cyclops::record::EventLog::open(path);
  if (!log.ok()) return fail(log.error());
  std::map<std::string, std::pair<std::int64_t, std::int64_t>> channels;
  cyclops::record::LogEvent event;
  std::uint32_t bytes = 0;
  std::int64_t first = 0, last = 0, n = 0;
  int status = 0;
  while (true) {
    auto more = log->skim(event, bytes);
    if (!more.ok()) {
      status = fail(more.error());
      break;
    }
    if (!*more) break;
    if (n++ == 0) first = event.time_us;
    last = event.time_us;
    ++channels[event.channel].first;
    channels[event.channel].second += bytes;
  }
  std::printf("%s: %lld events, %.1f MB, %.2f s\n", path.c_str(), static_cast<long long>(n), static_cast<double>(log->size()) * 1e-6, static_cast<double>(last - first) * 1e-6);
  for (const auto& [name, sums] : channels)
    std::printf("  %-16s %8lld events %12lld bytes %8.1f Hz\n", name.c_str(), static_cast<long long>(sums.first), static_cast<long long>(sums.second),
                last > first ? static_cast<double>(sums.first) * 1e6 / static_cast<double>(last - first) : 0.0);
  return status;
}

int diff(const std::string& a, const std::string& b, const cyclops::tools::DiffOptions& options) {
  const auto d = cyclops::tools::diff_logs(a, b, options);
  if (!d.ok()) return fail(d.error());
  std::printf("%lld and %lld frames: %lld equal bit for bit, %lld different, %lld only in the first, %lld only in the second\n", static_cast<long long>(d->frames_a),
              static_cast<long long>(d->frames_b), static_cast<long long>(d->equal), static_cast<long long>(d->different), static_cast<long long>(d->only_a),
              static_cast<long long>(d->only_b));
  if (d->first_frame_seq >= 0) std::printf("first difference: frame %lld, %s\n", static_cast<long long>(d->first_frame_seq), d->first_stage.c_str());
  return d->same() ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Looks into event logs of the service."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.require_subcommand(1);
  std::string a, b;
  auto* show = app.add_subcommand("info", "channels, counts and rates of a log");
  show->add_option("log", a)->required();
  auto* compare = app.add_subcommand("diff", "are two logs the same, bit for bit? exit code 2 when not");
  compare->add_option("first", a)->required();
  compare->add_option("second", b)->required();
  cyclops::tools::DiffOptions how;
  compare->add_flag("--by-seq", how.by_seq, "pair frames by number instead of time: two logs of the same inputs");
  compare->add_option("--before", how.before, "only frames with a seq below this");
  compare->add_flag("--heard", how.heard, "the second was heard over a network and may lack messages");
  auto* csv = app.add_subcommand("csv", "measurements of a log as a table");
  csv->add_option("log", a)->required();
  csv->add_option("out", b)->required();
  CLI11_PARSE(app, argc, argv);
  if (show->parsed()) return info(a);
  if (compare->parsed()) return diff(a, b, how);
  const auto done = cyclops::tools::measurements_csv(a, b);
  return done.ok() ? 0 : fail(done.error());
}
