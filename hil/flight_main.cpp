#include <CLI/CLI.hpp>
#include <cstdio>

#include "hil/flight.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Flies a scenario and writes it as a flight folder: pixels, messages, truth and rig."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  std::string path;
  cyclops::hil::FlightOptions options;
  std::int64_t seed = 0;
  int frames = 0;
  app.add_option("--scenario", path, "TOML file, config/scenarios/*.toml")->required();
  app.add_option("-o,--out", options.out, "flight folder to write")->required();
  auto* seed_option = app.add_option("--seed", seed, "in place of the scenario's");
  auto* frames_option = app.add_option("--frames", frames, "in place of the scenario's")->check(CLI::Range(1, 100000));
  app.add_option("--threads", options.threads, "frames rendered at a time")->capture_default_str()->check(CLI::Range(1, 256));
  app.add_flag("--replace", options.replace, "remove a flight that is already there");
  CLI11_PARSE(app, argc, argv);
  const auto fail = [](const cyclops::Error& e) {
    std::fprintf(stderr, "cyclops-flight: %s\n", e.message().c_str());
    return 1;
  };
  auto scenario = cyclops::hil::Scenario::load(path);
  if (!scenario.ok()) return fail(scenario.error());
  if (seed_option->count() > 0) scenario->seed = seed;
  if (frames_option->count() > 0) scenario->frames = frames;
  options.source = "cyclops-flight, scenario " + scenario->name + ", seed " + std::to_string(scenario->seed);
  options.progress = [](int done, int of) {
    if (done % 10 == 0 || done == of) std::fprintf(stderr, "\r%d of %d frames%s", done, of, done == of ? "\n" : "");
  };
  const auto report = cyclops::hil::make_flight(*scenario, options);
  if (!report.ok()) return fail(report.error());
  std::printf("%s: %d frames, projection error %.2f px (drawn errors times %.2f), motion %.2f px a frame, %.1f features visible, %.1f not scored, %.0f ms a frame and thread\n", options.out.c_str(),
              scenario->frames, report->projection_error_px, report->error_scale, report->motion_px, report->visible, report->doubtful, report->render_ms);
  return 0;
}
