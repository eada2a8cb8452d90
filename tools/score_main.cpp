#include <cstdio>
#include <fstream>
#include <algorithm>
#include <sstream>

#include <CLI/CLI.hpp>

#include "tools/score.hpp"

namespace {

using nlohmann::json;

bool merge(json& into, const std::string& path, const std::vector<std::string>& keys) {
  if (path.empty()) return true;
  std::ifstream in(path);
  json j = json::parse(in, nullptr, false);
  if (j.is_discarded() || !j.is_object()) {
    std::fprintf(stderr, "cyclops-score: %s: is no JSON object\n", path.c_str());
    return false;
  }
  for (auto& [key, value] : j.items())
    if (keys.empty() || std::find(keys.begin(), keys.end(), key) != keys.end()) into[key] = value;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Compares a log of published messages with the truth of its flight."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  std::string flight, log, summary, scores, service, replay;
  app.add_option("flight", flight)->required();
  app.add_option("log", log, "event log of what was published")->required();
  app.add_option("--summary", summary, "figures as JSON")->required();
  app.add_option("--scores", scores, "errors by frame and feature as CSV");
  app.add_option("--service", service, "summary of the service, to be included");
  app.add_option("--replay", replay, "summary of the replayer, to be included");
  CLI11_PARSE(app, argc, argv);
  const auto run = cyclops::tools::load_run(flight, log);
  if (!run.ok()) {
    std::fprintf(stderr, "cyclops-score: %s\n", run.error().message().c_str());
    return 1;
  }
  json j = cyclops::tools::summarise(*run);
  if (!merge(j, service, {}) || !merge(j, replay, {"flight", "frames_served", "frames_unsent", "realtime_factor", "late", "max_late_ms", "speed"})) return 1;
  std::ofstream out(summary);
  out << j.dump(2) << "\n";
  if (!out) return std::fprintf(stderr, "cyclops-score: %s cannot be written\n", summary.c_str()), 1;
  if (!scores.empty())
    if (auto done = cyclops::tools::write_csv(*run, scores); !done.ok()) return std::fprintf(stderr, "cyclops-score: %s\n", done.error().message().c_str()), 1;
  return 0;
}
