#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "tools/offline.hpp"
#include "tools/wingrock_data.hpp"

namespace {

using namespace cyclops::tools;
using nlohmann::json;

enum Exit { kGood = 0, kCannot = 1, kNotEnough = 2 };
constexpr double kDeg = 3.14159265358979323846 / 180;

int fail(const cyclops::Error& error) {
  std::fprintf(stderr, "cyclops-wingrock: %s\n", error.message().c_str());
  return kCannot;
}

struct Injected {
  double offset_ms{0};
  double drift_ppm{0};
};

/// The series as if the frames had been stamped by a clock that is off by this much.
RollSeries with(const RollSeries& seen, const Injected& wrong) {
  RollSeries out = seen;
  if (seen.t_s.empty()) return out;
  const double mid = 0.5 * (seen.t_s.front() + seen.t_s.back());
  for (double& t : out.t_s) t += wrong.offset_ms * 1e-3 + wrong.drift_ppm * 1e-6 * (t - mid);
  return out;
}

/// Peak to peak bank of one aircraft in a manoeuvre.
double bank_span_deg(const WingRockData& data, const Manoeuvre& m, double offset_s, bool tanker) {
  double low = 1e9, high = -1e9;
  for (double t = m.begin_s; t <= m.end_s; t += 0.05)
    if (const double b = data.bank_deg(tanker, t + offset_s); !std::isnan(b)) low = std::min(low, b), high = std::max(high, b);
  return high > low ? high - low : 0;
}

void print(const WingRockData& data, const WingRockResult& r, std::size_t frames) {
  std::printf("frames with image roll  %zu over %.1f s\n", frames, data.seen().t_s.empty() ? 0.0 : data.seen().t_s.back() - data.seen().t_s.front());
  if (data.by_arrival()) std::printf("frame times             made from arrivals: GPS time was unknown\n");
  for (const Manoeuvre& m : r.manoeuvres)
    std::printf("manoeuvre               %7.2f to %7.2f s  roll %.1f deg (receiver %.1f, tanker %.1f)  alone %+.2f +- %.2f ms off the line\n", m.begin_s, m.end_s, m.roll_deg,
                bank_span_deg(data, m, r.offset_s, false), bank_span_deg(data, m, r.offset_s, true), 1e3 * m.offset_s, 1e3 * m.sigma_s);
  if (!r.enough) {
    std::printf("no answer               %s\n", r.reason.c_str());
    return;
  }
  std::printf("offset                  %+.2f ms +- %.2f (1 sigma) at %.2f s: TSPI time = frame time + offset\n", 1e3 * r.offset_s, 1e3 * r.offset_sigma_s, r.t_mid_s);
  if (r.has_drift) std::printf("drift                   %+.0f ppm +- %.0f (1 sigma)\n", 1e6 * r.drift, 1e6 * r.drift_sigma);
  else std::printf("drift                   not to be had from manoeuvres this close together; taken as 0\n");
  std::printf("gain %.3f +- %.3f  correlation %.5f  residual %.3f deg rms  next best place %.1f times as bad  chi2 of the manoeuvres %.2f\n", r.gain, r.gain_sigma, r.correlation,
              r.residual_deg, r.runner_up, r.chi2);
}

json summary(const WingRockResult& r, std::size_t frames) {
  json list = json::array();
  for (const Manoeuvre& m : r.manoeuvres)
    list.push_back({{"begin_s", m.begin_s}, {"end_s", m.end_s}, {"roll_deg", m.roll_deg}, {"alone_ms", 1e3 * m.offset_s}, {"alone_sigma_ms", 1e3 * m.sigma_s}});
  json j{{"enough", r.enough}, {"frames", frames}, {"manoeuvres", list}};
  if (!r.enough) j["reason"] = r.reason;
  j["offset_ms"] = 1e3 * r.offset_s, j["offset_sigma_ms"] = 1e3 * r.offset_sigma_s, j["at_s"] = r.t_mid_s, j["has_drift"] = r.has_drift;
  j["drift_ppm"] = 1e6 * r.drift, j["drift_sigma_ppm"] = 1e6 * r.drift_sigma, j["gain"] = r.gain, j["gain_sigma"] = r.gain_sigma;
  j["correlation"] = r.correlation, j["residual_deg"] = r.residual_deg, j["runner_up"] = r.runner_up, j["chi2"] = r.chi2;
  return j;
}

/// The waveform as a table, degrees; `tspi` at the frame's own stamp, `fit` where the answer puts it.
bool write_csv(const std::string& path, const WingRockData& data, const RollSeries& seen, const WingRockResult& r) {
  std::ofstream out(path);
  out << "t_s,image_roll_deg,tspi_roll_deg,fit_deg\n";
  for (std::size_t i = 0; i < seen.t_s.size(); ++i)
    out << seen.t_s[i] << ',' << seen.roll_rad[i] / kDeg << ',' << data.roll_at(i, seen.t_s[i]) / kDeg << ',' << r.fitted_rad[i] / kDeg << '\n';
  return static_cast<bool>(out.flush());
}

/// A log that is removed at the end.
struct Scratch {
  std::string path = (std::filesystem::temp_directory_path() / ("cyclops-wingrock-" + std::to_string(getpid()) + ".lcm")).string();
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Checks frame times against TSPI by roll: offset and drift from the whole waveform of wing rocks."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.footer("Exit code: 0 an answer, 1 cannot run, 2 not enough roll motion for one.");
  std::string flight, log, json_path, csv_path;
  WingRockConfig config;
  Injected wrong;
  double most_sigma_ms = 1e3 * config.most_sigma_s;
  app.add_option("flight", flight, "flight folder: TSPI and rig")->required();
  app.add_option("log", log, "event log with MEASUREMENT of it, live or of cyclops-offline; made here when left out");
  app.add_option("--search", config.search_s, "seconds to either side")->capture_default_str()->check(CLI::Range(0.1, 120.0));
  app.add_option("--most-sigma-ms", most_sigma_ms, "an offset less certain than this is no answer")->capture_default_str()->check(CLI::PositiveNumber);
  app.add_option("--json", json_path, "figures as JSON");
  app.add_option("--csv", csv_path, "the waveforms as a table, for tools/wingrock_plot.py");
  app.add_option("--wrong-ms", wrong.offset_ms, "to try it: frames are stamped late by this");
  app.add_option("--wrong-ppm", wrong.drift_ppm, "to try it: and by a clock this much too fast");
  CLI11_PARSE(app, argc, argv);
  config.most_sigma_s = 1e-3 * most_sigma_ms;

  const Scratch scratch;
  if (log.empty()) {
    log = scratch.path;
    const auto done = run_offline(flight, cyclops::Profile(), log, {});
    if (!done.ok()) return fail(done.error());
  }
  const auto data = WingRockData::load(flight, log);
  if (!data.ok()) return fail(data.error());
  const RollSeries seen = with((*data)->seen(), wrong);
  const WingRockResult r = wing_rock(seen, [&](std::size_t frame, double t_s) { return (*data)->roll_at(frame, t_s); }, config);
  print(**data, r, seen.t_s.size());
  if (!csv_path.empty() && !write_csv(csv_path, **data, seen, r)) return fail(cyclops::make_error(cyclops::ErrorCode::kIo, csv_path, "cannot be written"));
  if (!json_path.empty()) {
    std::ofstream out(json_path);
    out << summary(r, seen.t_s.size()).dump(2) << "\n";
    if (!out.flush()) return fail(cyclops::make_error(cyclops::ErrorCode::kIo, json_path, "cannot be written"));
  }
  return r.enough ? kGood : kNotEnough;
}
