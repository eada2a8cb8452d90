#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "tools/import.hpp"

int main(int argc, char** argv) {
  CLI::App app{"A folder of pictures with poses becomes a flight."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  cyclops::tools::ImportOptions options;
  app.add_option("folder", options.folder, "frames/, camera.json, features.csv, prior*.csv, truth.csv")->required();
  app.add_option("--prior", options.prior, "poses of the model in the camera frame; a file of the folder")->capture_default_str();
  auto* truth = app.add_option("--truth", options.truth, "true pixels; a file of the folder, left out when absent")->capture_default_str();
  app.add_option("--rate", options.rate_hz, "frames per second where the prior has no timestamps")->capture_default_str()->check(CLI::Range(0.1, 1000.0));
  app.add_option("--prior-sigma-px", options.prior_sigma_px, "1 sigma of the prior on the image, px an axis; 0: estimated")->check(CLI::Range(0.0, 500.0));
  app.add_option("-o,--out", options.out, "flight folder to write")->required();
  CLI11_PARSE(app, argc, argv);
  options.truth_required = truth->count() > 0;
  const auto report = cyclops::tools::import_folder(options);
  if (!report.ok()) {
    std::fprintf(stderr, "cyclops-import: %s\n", report.error().message().c_str());
    return 1;
  }
  const std::string without = report->frames_without_truth > 0 ? " (" + std::to_string(report->frames_without_truth) + " frames without)" : "";
  std::printf("%s: %lld frames %d x %d, %d bit%s, %zu features, truth %s%s, navigation marked every %d frames, prior sigma %.1f px\n", options.out.c_str(),
              static_cast<long long>(report->frames), report->width, report->height, report->sixteen_bit ? 16 : 8, report->from_colour ? " (from colour)" : "",
              report->features, report->has_truth ? "yes" : "no", without.c_str(), report->nav_every_n, report->sigma_px);
  return 0;
}
