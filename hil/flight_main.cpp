#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#include <unistd.h>

#include "hil/atlas.hpp"
#include "hil/flight.hpp"
#include "hil/flight_scene.hpp"

namespace {

volatile std::sig_atomic_t g_stop = 0;

void show(int done, int of, double spent_s) {
  if (isatty(2) == 0 && done != of) return;
  constexpr int kBar = 30;
  const int full = kBar * done / of;
  std::fprintf(stderr, "\r[%.*s%*s] %d of %d frames, %.0f ms a frame, %.0f s to go   %s", full, "##############################", kBar - full, "", done, of, 1e3 * spent_s / done,
               spent_s / done * (of - done), done == of ? "\n" : "");
}

/// Pictures of the scenario's tanker, seen from where its receiver starts.
cyclops::Result<> draw(const cyclops::hil::Scenario& s, const std::string& folder) {
  const auto scene = cyclops::hil::FlightScene::load(s);
  if (!scene.ok()) return scene.error();
  cyclops::hil::AtlasOptions o;
  o.reference_m = s.reference_in * 0.0254;
  o.range_m = s.range_ft * 0.3048;
  o.elevation_deg = s.elevation_deg;
  o.azimuth_deg = s.azimuth_deg;
  return cyclops::hil::draw_atlas(folder, (*scene)->mesh, (*scene)->model, o);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Flies a scenario and writes it as a flight folder: pixels, messages, truth, rig and figures."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.footer("Pictures are kept in the cache and shared by flights that differ in navigation alone (docs/flights.md).");
  std::string path, navigation, atlas;
  cyclops::hil::FlightOptions options;
  options.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::int64_t seed = 0, picture_seed = 0;
  int frames = 0;
  bool quiet = false;
  app.add_option("--scenario", path, "TOML file, config/scenarios/*.toml")->required();
  auto* made = app.add_option_group("What is made");
  made->add_option("-o,--out", options.out, "flight folder to write");
  made->add_option("--atlas", atlas, "in place of a flight: folder for pictures of the tanker's shape and features");
  made->require_option(1);
  auto* seed_option = app.add_option("--seed", seed, "of the navigation errors, in place of the scenario's");
  auto* picture_option = app.add_option("--picture-seed", picture_seed, "of motion, sky and noise, in place of the scenario's");
  app.add_option("--navigation", navigation, "in place of the scenario's: measured or true (no errors)")->check(CLI::IsMember({"measured", "true"}));
  auto* frames_option = app.add_option("--frames", frames, "in place of the scenario's")->check(CLI::Range(1, 100000));
  app.add_option("--cache", options.cache, "folder of pictures; `cache` beside the flight when left out");
  app.add_option("--threads", options.threads, "frames rendered at a time")->capture_default_str()->check(CLI::Range(1, 256));
  app.add_flag("--replace", options.replace, "put it in place of a flight that is already there");
  app.add_flag("-q,--quiet", quiet, "no progress");
  CLI11_PARSE(app, argc, argv);
  const auto fail = [](const cyclops::Error& e) {
    std::fprintf(stderr, "%scyclops-flight: %s\n", g_stop != 0 ? "\n" : "", e.message().c_str());
    return g_stop != 0 ? 130 : 1;
  };
  auto scenario = cyclops::hil::Scenario::load(path);
  if (!scenario.ok()) return fail(scenario.error());
  if (!atlas.empty()) {
    const auto drawn = draw(*scenario, atlas);
    if (!drawn.ok()) return fail(drawn.error());
    std::printf("%s: three_view.png, receiver.png, contact.png, features.png\n", atlas.c_str());
    return 0;
  }
  if (seed_option->count() > 0) scenario->navigation.seed = seed;
  if (picture_option->count() > 0) scenario->seed = picture_seed;
  if (frames_option->count() > 0) scenario->frames = frames;
  if (!navigation.empty()) scenario->navigation.is_true = navigation == "true";
  options.source = "cyclops-flight, scenario " + scenario->name + ", seeds " + std::to_string(scenario->seed) + " and " + std::to_string(scenario->navigation.seed) +
                   (scenario->navigation.is_true ? ", navigation true" : "");
  std::signal(SIGINT, [](int) { g_stop = 1; });
  std::signal(SIGTERM, [](int) { g_stop = 1; });
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is then an error of the write, with its name
  options.stop = [] { return g_stop != 0; };
  const auto begin = std::chrono::steady_clock::now();
  if (!quiet) options.progress = [&](int done, int of) { show(done, of, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()); };
  const auto report = cyclops::hil::make_flight(*scenario, options);
  if (!report.ok()) return fail(report.error());
  std::printf("%s: %d frames, projection error %.2f px, motion %.2f px a frame, %.1f features visible, %.1f not scored, ", options.out.c_str(), scenario->frames,
              report->projection_error_px, report->motion_px, report->visible, report->doubtful);
  if (report->rendered) std::printf("rendered in %.1f s (%.0f ms a frame)\n", report->render_s, 1e3 * report->render_s / scenario->frames);
  else std::printf("pictures from the cache\n");
  return 0;
}
