#include <csignal>
#include <cstdio>
#include <fstream>

#include <CLI/CLI.hpp>
#include <sys/mman.h>
#include <time.h>

#include "base/log.hpp"
#include "service/pipeline.hpp"

namespace {

enum Exit { kGood = 0, kBadConfig = 1, kCannotRun = 3, kNoFrame = 4, kNotRecorded = 5 };

/// Waits for SIGINT or SIGTERM; true when one came.
bool wait_for_signal(const sigset_t& set, long ms) {
  const timespec t{ms / 1000, (ms % 1000) * 1'000'000};
  return sigtimedwait(&set, nullptr, &t) > 0;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace cyclops;
  CLI::App app{"Cyclops: watches the tanker through a GigE Vision camera and publishes measured feature points over LCM."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.footer("Exit code: 0 stopped by a signal, 1 bad configuration, 3 cannot run (LCM, strobe), 4 stopped without a single frame, 5 the record was not finished.");
  std::string rig_path, profile_path, alarms_path, key_path, summary_path;
  ServiceOptions options;
  double exit_when_idle_s = 0;
  double reserve_mb = 256, split_mb = 4096;
  bool verbose = false;
  app.add_option("--rig", rig_path, "rig.toml: camera, mount, tanker, strobe")->required();
  app.add_option("--config", profile_path, "profile; the built-in default when left out");
  app.add_option("--lcm", options.lcm_url, "LCM URL; LCM_DEFAULT_URL when left out");
  app.add_option("--thumbnail-hz", options.thumbnail_hz, "small JPEG in FRAME, 0 for none")->capture_default_str()->check(CLI::Range(0.0, 30.0));
  app.add_option("--thumbnail-px", options.thumbnail_px, "its longer side")->capture_default_str()->check(CLI::Range(64, 1024));
  app.add_option("--alarms", alarms_path, "limits of HEALTH; the built-in ones (config/alarms.toml) when left out");
  app.add_option("--key", key_path, "key file: TSPI, time marks and event marks must carry a tag made with it");
  app.add_option("--summary", summary_path, "figures of the run as JSON, written at the end");
  app.add_option("--exit-when-idle", exit_when_idle_s, "end by itself when frames came and then none for so many seconds; 0: never")->check(CLI::Range(0.0, 3600.0));
  app.add_option("--record", options.record.folder, "records a sortie: a new folder in this one");
  app.add_option("--record-name", options.record.name, "name of the sortie's folder; the time (UTC) when left out");
  app.add_option("--record-limit", options.record.limit_mbps, "MB/s of pixels at most; 0: no limit")->check(CLI::Range(0.0, 100000.0));
  app.add_option("--record-reserve", reserve_mb, "MB of free disk kept for messages: below it no pixels are recorded")->capture_default_str()->check(CLI::Range(0.0, 1e6));
  app.add_option("--record-split", split_mb, "MB after which a log goes on in a new file")->capture_default_str()->check(CLI::Range(1.0, 1e6));
  app.add_flag("-v,--verbose", verbose, "more words in the log");
  CLI11_PARSE(app, argc, argv);
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before any thread, so that only the wait below sees them
  log::start(verbose ? log::Level::kDebug : log::Level::kInfo);

  auto rig = Rig::load(rig_path);
  if (!rig.ok()) return log::error("config", rig.error().message()), kBadConfig;
  Profile profile;
  if (!profile_path.empty()) {
    auto loaded = Profile::load(profile_path);
    if (!loaded.ok()) return log::error("config", loaded.error().message()), kBadConfig;
    profile = std::move(loaded).value();
  }
  if (!alarms_path.empty()) {
    auto limits = Limits::load(alarms_path);
    if (!limits.ok()) return log::error("config", limits.error().message()), kBadConfig;
    options.limits = std::move(limits).value();
  }
  if (!key_path.empty()) {
    auto key = Key::load(key_path);
    if (!key.ok()) return log::error("config", key.error().message()), kBadConfig;
    options.key = *key;
  }
  options.profile_path = profile_path;
  options.record.reserve_bytes = static_cast<std::int64_t>(reserve_mb * 1024 * 1024);
  options.record.split_bytes = static_cast<std::int64_t>(split_mb * 1024 * 1024);
  (void)mlockall(MCL_CURRENT | MCL_FUTURE);       // wanted in flight, not needed on a bench without the right

  Pipeline pipeline(std::move(rig).value(), profile, options);
  if (auto started = pipeline.start(); !started.ok()) return log::error("service", started.error().message()), kCannotRun;
  log::info("service", std::string("version ") + CYCLOPS_VERSION + ", profile " + profile.name + ", rig " + rig_path);
  while (!wait_for_signal(signals, 200))
    if (exit_when_idle_s > 0 && pipeline.idle_s() > exit_when_idle_s) break;
  log::info("service", "stopping");
  const auto stopped = pipeline.stop();
  if (!stopped.ok()) log::error("record", stopped.error().message());
  if (!summary_path.empty()) {
    std::ofstream out(summary_path);
    out << pipeline.summary() << "\n";
    if (!out) log::error("service", summary_path + ": cannot be written");
  }
  log::info("service", std::to_string(pipeline.frames()) + " frames went through the chain");
  if (!stopped.ok()) return kNotRecorded;
  return pipeline.frames() > 0 ? kGood : kNoFrame;
}
