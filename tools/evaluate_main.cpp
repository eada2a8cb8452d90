#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "tools/evaluate_tables.hpp"
#include "tools/offline.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Runs a flight as cyclops-offline does and writes every frame and feature beside the truth, as NumPy tables."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  std::string flight, config, out, tanker, looks;
  app.add_option("flight", flight, "flight folder with truth")->required();
  app.add_option("--config", config, "profile; the built-in default when left out");
  app.add_option("--out", out, "folder for features.npy, frames.npy and rig.json")->required();
  app.add_option("--tanker", tanker, "model file in place of the flight's own, as cyclops-learn writes it");
  app.add_option("--looks", looks, "learnt looks of the features of that model");
  std::int64_t first = 0;
  app.add_option("--from", first, "frames before this one are flown, and left out of the tables")->check(CLI::NonNegativeNumber);
  std::int64_t frames = std::numeric_limits<std::int64_t>::max();
  app.add_option("--frames", frames, "ends after so many")->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  const auto fail = [](const cyclops::Error& e) {
    std::fprintf(stderr, "cyclops-evaluate: %s\n", e.message().c_str());
    return 1;
  };
  cyclops::Profile profile;
  if (!config.empty()) {
    auto loaded = cyclops::Profile::load(config);
    if (!loaded.ok()) return fail(loaded.error());
    profile = *loaded;
  }
  auto tables = cyclops::tools::EvaluationTables::create(flight, first);
  if (!tables.ok()) return fail(tables.error());
  std::error_code ignored;
  std::filesystem::create_directories(out, ignored);
  const std::string log = out + "/published.lcm";
  const auto result = cyclops::tools::run_offline(
      flight, profile, log, {}, [&](const cyclops::Rig& r, const cyclops::FrameOutput& frame, const cyclops::ImageView&) { tables->add(r, frame); }, {.tanker = tanker, .looks = looks, .most_frames = frames});
  std::filesystem::remove(log, ignored);
  if (!result.ok()) return fail(result.error());
  auto loaded = cyclops::Rig::load(flight + "/rig.toml", tanker);
  if (!loaded.ok()) return fail(loaded.error());
  if (auto done = tables->write(*loaded, out); !done.ok()) return fail(done.error());
  std::printf("%s: %lld frames, %zu rows\n", out.c_str(), static_cast<long long>(result->frames_out), tables->features().size());
  return 0;
}
