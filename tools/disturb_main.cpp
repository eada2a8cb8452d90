#include <CLI/CLI.hpp>
#include <cstdio>

#include "tools/disturb.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Copies a flight with something wrong in it: a step of navigation, a link that stands still, an occluded camera."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  std::string from, to;
  std::vector<int> occluded;
  cyclops::tools::Disturbance how;
  app.add_option("flight", from, "flight folder")->required();
  app.add_option("--out", to, "flight folder to write")->required();
  app.add_option("--at", how.at_s, "s after the first frame from which navigation is disturbed")->capture_default_str();
  app.add_option("--for", how.for_s, "s that it lasts; to the end when left out")->check(CLI::PositiveNumber);
  app.add_option("--position", how.position_m, "the tanker's position is off by this, m, in a drawn direction");
  app.add_option("--attitude", how.attitude_deg, "its attitude is off by this, deg, about a drawn axis");
  app.add_option("--position-sigma", how.position_sigma_m, "stated per axis, m, in place of what is said")->check(CLI::PositiveNumber);
  app.add_option("--attitude-sigma", how.attitude_sigma_deg, "stated per axis, deg")->check(CLI::PositiveNumber);
  app.add_flag("--frozen", how.frozen, "the tanker's reports stand still while their time goes on");
  app.add_option("--seed", how.seed, "of the directions");
  app.add_option("--last-frame", how.last_frame, "the copy ends with this frame")->check(CLI::PositiveNumber);
  app.add_option("--occlude", occluded, "first and last frame that show sky alone, as often as wanted: 30 45 90 120");
  CLI11_PARSE(app, argc, argv);
  if (occluded.size() % 2 != 0) {
    std::fprintf(stderr, "cyclops-disturb: --occlude has %zu numbers, expected pairs of first and last frame\n", occluded.size());
    return 1;
  }
  for (std::size_t i = 0; i < occluded.size(); i += 2) how.occlusions.push_back({occluded[i], occluded[i + 1]});
  if (auto done = cyclops::tools::disturb_flight(from, to, how); !done.ok()) {
    std::fprintf(stderr, "cyclops-disturb: %s\n", done.error().message().c_str());
    return 1;
  }
  std::printf("%s\n", to.c_str());
  return 0;
}
