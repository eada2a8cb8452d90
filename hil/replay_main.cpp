#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>
#include <thread>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "hil/replayer.hpp"

namespace {

using cyclops::hil::Replayer;
using cyclops::hil::ReplayProgress;

/// One command a line, from a person or a script.
void obey(Replayer& replayer, const std::string& line) {
  std::istringstream words(line);
  std::string word;
  double value = 0;
  words >> word;
  const bool has_value = static_cast<bool>(words >> value);
  if (word == "pause") replayer.pause();
  else if (word == "play") replayer.play();
  else if (word == "step") replayer.step(has_value ? std::max(1, static_cast<int>(value)) : 1);
  else if (word == "seek" && has_value && value >= 0) replayer.seek(value);
  else if (word == "speed" && has_value && (value == 0 || (value >= 0.1 && value <= 20))) replayer.set_speed(value);
  else if (word == "quit") replayer.quit();
  else if (!word.empty()) std::fprintf(stderr, "\nunknown command \"%s\"; known: pause, play, step [N], seek SECONDS, speed 0|0.1..20, quit\n", line.c_str());
}

void show(const ReplayProgress& p) {
  std::fprintf(stderr, "\r%6.1f of %.1f s  %5lld frames  x%.2f  late %lld%s ", p.flight_s, p.length_s, static_cast<long long>(p.frames), p.realtime_factor,
               static_cast<long long>(p.late), p.paused ? "  paused" : "");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Plays a flight as a GigE Vision camera with strobe edges and TSPI; the service cannot tell the difference."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.footer("While it runs, on standard input: pause, play, step [N], seek SECONDS, speed X, quit.");
  cyclops::hil::ReplayOptions options;
  std::string summary_path;
  double wait_s = 30;
  bool quiet = false;
  app.add_option("flight", options.flight, "flight folder")->required();
  app.add_option("--speed", options.speed, "0.1 to 20; 0: as fast as the service answers")->capture_default_str()->check([](const std::string& s) {
    const double v = std::strtod(s.c_str(), nullptr);
    return v == 0 || (v >= 0.1 && v <= 20) ? std::string() : "expected 0 or 0.1 to 20";
  });
  app.add_flag("--answered", options.answered, "slower than --speed rather than ahead of the service's answers, so that no frame is lost in a queue");
  app.add_flag("--loop", options.loop, "begin anew at the end");
  app.add_flag("--paused", options.paused, "wait for play or step");
  app.add_option("--start", options.start_s, "begin so many seconds into the flight")->check(CLI::NonNegativeNumber);
  app.add_option("--frames", options.most_frames, "stop after so many frames")->check(CLI::NonNegativeNumber);
  app.add_option("--seconds", options.most_s, "stop after so many seconds of flight")->check(CLI::NonNegativeNumber);
  app.add_option("--faults", options.faults, "script of what goes wrong (docs/faults.md)")->check(CLI::ExistingFile);
  app.add_option("--sent", options.sent_path, "CSV of every frame sent");
  app.add_option("--lcm", options.lcm_url, "LCM URL; LCM_DEFAULT_URL when left out");
  app.add_option("--address", options.address, "IPv4 to serve on; the rig's when left out");
  auto* sim = app.add_option("--gpio-sim", options.gpio_sim, "folder of a gpio-sim chip (tools/gpio_sim.sh makes one): strobe edges are pulses there");
  app.add_option("--gpio-strobe", options.gpio_strobe_line, "its line for the strobe")->capture_default_str()->check(CLI::Range(0, 4095))->needs(sim);
  app.add_option("--gpio-pps", options.gpio_pps_line, "its line for PPS, pulsed at each time mark; none when left out")->check(CLI::Range(0, 4095))->needs(sim);
  app.add_option("--wait", wait_s, "seconds to wait for a client")->capture_default_str()->check(CLI::Range(0.1, 3600.0));
  app.add_option("--summary", summary_path, "figures as JSON");
  app.add_flag("-q,--quiet", quiet, "no progress");
  CLI11_PARSE(app, argc, argv);
  options.wait_for_client = cyclops::Duration::from_seconds(wait_s);

  auto replayer = Replayer::open(options);
  if (!replayer.ok()) {
    std::fprintf(stderr, "cyclops-replay: %s\n", replayer.error().message().c_str());
    return 1;
  }
  std::thread([&r = **replayer] {
    for (std::string line; std::getline(std::cin, line);) obey(r, line);
  }).detach();
  const auto done = (*replayer)->run(quiet ? std::function<void(const ReplayProgress&)>() : show);
  if (!quiet) std::fprintf(stderr, "\n");
  const auto summary = (*replayer)->summary();
  if (!summary_path.empty()) {
    std::ofstream out(summary_path);
    out << summary.dump(2) << "\n";
    if (!out) std::fprintf(stderr, "cyclops-replay: %s cannot be written\n", summary_path.c_str());
  }
  if (!done.ok()) std::fprintf(stderr, "cyclops-replay: %s\n", done.error().message().c_str());
  std::fflush(nullptr);
  _exit(done.ok() ? 0 : 1);  // the thread that reads standard input cannot be woken
}
