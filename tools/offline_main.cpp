#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "tools/offline.hpp"
#include "tools/score.hpp"

namespace {

using nlohmann::json;

json times_us(const cyclops::Histogram& h) {
  return {{"p50", static_cast<double>(h.quantile(0.5).ns) * 1e-3}, {"p99", static_cast<double>(h.quantile(0.99).ns) * 1e-3}, {"max", static_cast<double>(h.max().ns) * 1e-3}};
}

json stages_json(const cyclops::tools::OfflineResult& r) {
  json j;
  for (std::size_t s = 0; s < cyclops::kStages; ++s) j[cyclops::to_string(static_cast<cyclops::Stage>(s))] = times_us(r.stage[s]);
  j["chain"] = times_us(r.chain);
  return j;
}

int fail(const cyclops::Error& error) {
  std::fprintf(stderr, "cyclops-offline: %s\n", error.message().c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Runs a flight through the stages of the service, without sockets: the same bits at every run."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  std::string flight, config, tanker, looks, out, summary_path, scores;
  bool quiet = false;
  app.add_option("flight", flight, "flight folder")->required();
  app.add_option("--config", config, "profile; that of the sortie or else the built-in default when left out");
  app.add_option("--tanker", tanker, "model file to use instead of the flight's own, in its axes and units");
  app.add_option("--looks", looks, "learnt looks of the features of that model, in place of the flight's own");
  app.add_option("--out", out, "measurements: .csv a table, .lcm every message as an LCM event log");
  app.add_option("--summary", summary_path, "figures as JSON; '-' for standard output");
  app.add_option("--scores", scores, "errors against truth by frame and feature, CSV");
  app.add_flag("-q,--quiet", quiet, "no progress");
  CLI11_PARSE(app, argc, argv);

  cyclops::Profile profile;
  if (const auto own = std::filesystem::path(flight) / "profile.toml"; config.empty() && std::filesystem::exists(own)) config = own.string();
  if (!config.empty()) {
    auto loaded = cyclops::Profile::load(config);
    if (!loaded.ok()) return fail(loaded.error());
    profile = *loaded;
  }
  const bool keep_log = std::filesystem::path(out).extension() == ".lcm";
  const std::string log = keep_log ? out : (std::filesystem::temp_directory_path() / ("cyclops-offline-" + std::to_string(getpid()) + ".lcm")).string();
  const bool show = !quiet && isatty(2) != 0;
  const auto result = cyclops::tools::run_offline(flight, profile, log, [&](double share) {
    if (show) std::fprintf(stderr, "\r%3.0f %%", 100 * share);
  }, {}, {.tanker = tanker, .looks = looks});
  if (show) std::fprintf(stderr, "\r     \r");
  const auto remove_log = [&] {
    std::error_code ignored;
    if (!keep_log) std::filesystem::remove(log, ignored);
  };
  if (!result.ok()) {
    remove_log();
    return fail(result.error());
  }
  auto scored = cyclops::tools::load_run(flight, log);
  if (scored.ok() && !out.empty() && !keep_log)
    if (auto done = cyclops::tools::measurements_csv({log}, out); !done.ok()) return remove_log(), fail(done.error());
  remove_log();
  if (!scored.ok()) return fail(scored.error());
  if (result->refused_messages > 0)
    std::fprintf(stderr, "cyclops-offline: %lld messages of the flight were refused, the first: %s\n", static_cast<long long>(result->refused_messages), result->first_refusal.c_str());

  if (result->without_pixels > 0)
    std::fprintf(stderr, "cyclops-offline: %lld frames have no pixels in the record; from frame %lld on this is not what was published\n", static_cast<long long>(result->without_pixels), static_cast<long long>(result->first_without_pixels));

  json j = cyclops::tools::summarise(*scored);
  j["flight"] = std::filesystem::weakly_canonical(flight).filename().string();
  j["profile"] = profile.name;
  j["version"] = CYCLOPS_VERSION;
  j["frames_served"] = result->frames;
  j["frames_received"] = result->frames_out;
  j["stage_us"] = stages_json(*result);
  j["realtime_factor"] = result->run_s > 0 ? result->flight_s / result->run_s : 0.0;
  j["refused_messages"] = result->refused_messages;
  j["frames_without_pixels"] = result->without_pixels;
  j["first_frame_without_pixels"] = result->first_without_pixels;
  if (!scores.empty())
    if (auto done = cyclops::tools::write_csv(*scored, scores); !done.ok()) return fail(done.error());
  if (summary_path == "-") std::printf("%s\n", j.dump(2).c_str());
  else if (!summary_path.empty()) {
    std::ofstream file(summary_path);
    file << j.dump(2) << "\n";
    if (!file) return fail(cyclops::make_error(cyclops::ErrorCode::kIo, summary_path, "cannot be written"));
  }
  if (summary_path != "-")
    std::printf("%s, %s: %lld frames, %.1f features measured a frame, error mean %.2f median %.2f p95 %.2f px, %.0f %% of visible within 3 px, chain p50 %.0f p99 %.0f us\n",
                j["flight"].get<std::string>().c_str(), profile.name.c_str(), static_cast<long long>(result->frames), j["features_matched_mean"].get<double>(),
                j["feature_error_px"]["mean"].get<double>(), j["feature_error_px"]["median"].get<double>(), j["feature_error_px"]["p95"].get<double>(),
                100 * j["share_within_3px"].get<double>(), j["stage_us"]["chain"]["p50"].get<double>(), j["stage_us"]["chain"]["p99"].get<double>());
  return 0;
}
