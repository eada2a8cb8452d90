#include <cstdio>
#include <filesystem>
#include <map>

#include <CLI/CLI.hpp>

#include "record/event_log.hpp"
#include "record/flight.hpp"
#include "tools/export.hpp"
#include "tools/log_diff.hpp"
#include "tools/offline.hpp"
#include "tools/sortie_check.hpp"
#include "tools/sortie_copy.hpp"

namespace {

namespace tools = cyclops::tools;
using ll = long long;

enum Exit { kGood = 0, kFailed = 1, kDiffers = 2 };

int fail(const cyclops::Error& error) {
  std::fprintf(stderr, "cyclops-log: %s\n", error.message().c_str());
  return kFailed;
}

int info_of_log(const std::string& path) {
  auto log = cyclops::record::EventLog::open(path);
  if (!log.ok()) return fail(log.error());
  std::map<std::string, std::pair<std::int64_t, std::int64_t>> channels;
  cyclops::record::LogEvent event;
  std::uint32_t bytes = 0;
  std::int64_t first = 0, last = 0, n = 0;
  int status = kGood;
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
  std::printf("%s: %lld events, %.1f MB, %.2f s\n", path.c_str(), static_cast<ll>(n), static_cast<double>(log->size()) * 1e-6, static_cast<double>(last - first) * 1e-6);
  for (const auto& [name, sums] : channels)
    std::printf("  %-16s %8lld events %12lld bytes %8.1f Hz\n", name.c_str(), static_cast<ll>(sums.first), static_cast<ll>(sums.second),
                last > first ? static_cast<double>(sums.first) * 1e6 / static_cast<double>(last - first) : 0.0);
  return status;
}

int info(const std::string& path) {
  if (!std::filesystem::is_directory(path)) return info_of_log(path);
  const auto report = tools::check_sortie(path);
  if (!report.ok()) return fail(report.error());
  tools::print_info(*report);
  if (!report->problems.empty()) std::printf("%zu problems: see cyclops-log verify\n", report->problems.size());
  return kGood;
}

int verify(const std::string& path) {
  const auto report = tools::check_sortie(path);
  if (!report.ok()) return fail(report.error());
  for (const std::string& p : report->problems) std::printf("%s\n", p.c_str());
  std::printf("%s: %lld frames, %lld with their pixels, %zu problems\n", path.c_str(), static_cast<ll>(report->frames_used), static_cast<ll>(report->frames_there), report->problems.size());
  return report->problems.empty() ? kGood : kDiffers;
}

int said(const cyclops::Result<tools::Copied>& done, const std::string& out) {
  if (!done.ok()) return fail(done.error());
  std::printf("%s: %lld frames, %lld with their pixels, %lld inputs, %lld published messages\n", out.c_str(), static_cast<ll>(done->frames), static_cast<ll>(done->pixels), static_cast<ll>(done->inputs),
              static_cast<ll>(done->published));
  return kGood;
}

int diff(const std::string& a, const std::string& b, const tools::DiffOptions& options) {
  const auto d = tools::diff_logs(a, b, options);
  if (!d.ok()) return fail(d.error());
  std::printf("%lld and %lld frames: %lld equal bit for bit, %lld different, %lld only in the first, %lld only in the second\n", static_cast<ll>(d->frames_a), static_cast<ll>(d->frames_b),
              static_cast<ll>(d->equal), static_cast<ll>(d->different), static_cast<ll>(d->only_a), static_cast<ll>(d->only_b));
  if (d->first_frame_seq >= 0) std::printf("first difference: frame %lld, %s\n", static_cast<ll>(d->first_frame_seq), d->first_stage.c_str());
  return d->same() ? kGood : kDiffers;
}

int run_export(const tools::ExportOptions& options) {
  const auto done = tools::export_all(options);
  if (!done.ok()) return fail(done.error());
  std::printf("%lld measurements, %lld navigation states, %lld health messages, %lld frames, %lld pictures\n", static_cast<ll>(done->measurements), static_cast<ll>(done->nav),
              static_cast<ll>(done->health), static_cast<ll>(done->frames), static_cast<ll>(done->pictures));
  return kGood;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Looks into sorties, flights and event logs of the service."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.footer("Exit code: 0 good, 1 cannot be done, 2 something is missing (verify) or differs (diff).");
  app.require_subcommand(1);
  std::string a, b;
  double from_s = 0, to_s = 1e12;
  tools::DiffOptions how;
  tools::ExportOptions what;
  auto* show = app.add_subcommand("info", "sizes, rates and times of a sortie, a flight or one log");
  show->add_option("path", a)->required();
  auto* check = app.add_subcommand("verify", "is a sortie whole? says exactly what is missing");
  check->add_option("sortie", a)->required();
  auto* recover = app.add_subcommand("recover", "makes a clean sortie of one that was cut off or is damaged");
  recover->add_option("sortie", a)->required();
  recover->add_option("out", b, "new folder")->required();
  auto* cut = app.add_subcommand("cut", "part of a sortie or flight as a flight of its own");
  cut->add_option("flight", a)->required();
  cut->add_option("out", b, "new folder")->required();
  cut->add_option("--from", from_s, "s after the first frame")->capture_default_str()->check(CLI::NonNegativeNumber);
  cut->add_option("--to", to_s, "s after the first frame")->check(CLI::NonNegativeNumber);
  auto* out = app.add_subcommand("export", "tables, pictures and films");
  out->add_option("folder", what.folder, "sortie or flight")->required();
  out->add_option("--log", what.logs, "what was published; a sortie's own when left out");
  out->add_option("--measurements", what.measurements, "CSV");
  out->add_option("--nav", what.nav, "CSV");
  out->add_option("--health", what.health, "CSV");
  out->add_option("--frames", what.frames, "folder for PNG with the exact counts");
  out->add_option("--pictures", what.pictures, "folder for PNG with measurements drawn in");
  out->add_option("--video", what.video, "film of the same (needs ffmpeg)");
  out->add_option("--from", what.from_s, "s after the first frame; for pictures")->check(CLI::NonNegativeNumber);
  out->add_option("--to", what.to_s, "s after the first frame; for pictures")->check(CLI::NonNegativeNumber);
  auto* compare = app.add_subcommand("diff", "are two logs the same, bit for bit? names the first frame and stage that differ");
  compare->add_option("first", a, "a log, or a sortie: what it published")->required();
  compare->add_option("second", b)->required();
  compare->add_flag("--by-seq", how.by_seq, "pair frames by number instead of time: two logs of the same inputs");
  compare->add_option("--before", how.before, "only frames with a seq below this");
  compare->add_flag("--heard", how.heard, "the second was heard over a network and may lack messages");
  auto* csv = app.add_subcommand("csv", "measurements of a log as a table");
  csv->add_option("log", a)->required();
  csv->add_option("out", b)->required();
  CLI11_PARSE(app, argc, argv);
  if (show->parsed()) return info(a);
  if (check->parsed()) return verify(a);
  if (recover->parsed()) return said(tools::recover_sortie(a, b), b);
  if (cut->parsed()) return said(tools::cut_flight(a, b, from_s, to_s), b);
  if (out->parsed()) return run_export(what);
  if (compare->parsed()) return diff(a, b, how);
  const auto done = tools::measurements_csv({a}, b);
  return done.ok() ? kGood : fail(done.error());
}
