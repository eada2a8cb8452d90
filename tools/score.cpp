#include "tools/score.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <set>

#include <cyclops/frame_index_t.hpp>
#include <cyclops/measurement_set_t.hpp>
#include <cyclops/prediction_set_t.hpp>
#include <cyclops/nav_state_t.hpp>
#include <cyclops/track_set_t.hpp>

#include "record/event_log.hpp"
#include "record/flight.hpp"

namespace cyclops::tools {
namespace {

using nlohmann::json;

template <class T>
bool decode(const record::LogEvent& event, T& out) {
  return out.decode(event.data.data(), 0, static_cast<int>(event.data.size())) == static_cast<int>(event.data.size());
}

double quantile(std::vector<double>& sorted, double q) {
  if (sorted.empty()) return 0;
  return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(q * static_cast<double>(sorted.size())))];
}

}  // namespace

json distribution(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (double v : values) sum += v;
  const auto n = values.size();
  return {{"n", n},
          {"mean", n == 0 ? 0 : sum / static_cast<double>(n)},
          {"median", quantile(values, 0.5)},
          {"p95", quantile(values, 0.95)},
          {"p99", quantile(values, 0.99)},
          {"max", n == 0 ? 0 : values.back()}};
}

namespace {

double share(std::int64_t part, std::int64_t whole) { return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole); }

struct Messages {  // newest message of each kind for one mid-exposure time
  frame_index_t frame;
  prediction_set_t prediction;
  measurement_set_t measurement;
  track_set_t track;
  bool has_measurement{false};
};

using ByTime = std::map<std::int64_t, Messages>;

Result<ByTime> read_published(const std::string& path) {
  ByTime out;
  auto log = record::EventLog::open(path);
  if (!log.ok()) return log.error();
  record::LogEvent event;
  while (true) {
    const auto more = log->next(event);
    if (!more.ok()) return more.error();
    if (!*more) return out;
    if (event.channel == "FRAME") {
      frame_index_t m;
      if (decode(event, m)) out[m.mid_exposure_ns].frame = m;
    } else if (event.channel == "PREDICTION") {
      prediction_set_t m;
      if (decode(event, m)) out[m.mid_exposure_ns].prediction = m;
    } else if (event.channel == "TRACK") {
      track_set_t m;
      if (decode(event, m)) out[m.mid_exposure_ns].track = m;
    } else if (event.channel == "MEASUREMENT") {
      measurement_set_t m;
      if (decode(event, m)) {
        auto& slot = out[m.mid_exposure_ns];
        slot.measurement = m;
        slot.has_measurement = true;
      }
    }
  }
}

void fill(Scored& s, const Messages& m, const truth_t& truth) {
  for (const auto& p : m.prediction.items)
    if (p.id == s.id && p.visibility != prediction_t::BEHIND_CAMERA && p.visibility != prediction_t::DISABLED &&
        p.visibility != prediction_t::HIDDEN) {
      s.predicted = true;
      s.predicted_u = p.uv_px[0];
      s.predicted_v = p.uv_px[1];
    }
  for (const auto& t : m.track.items)
    if (t.id == s.id) {
      s.track_state = t.state;
      s.track_change = t.change;
    }
  for (const auto& z : m.measurement.items)
    if (z.id == s.id && z.accepted) {
      s.measured = true;
      s.u = z.raw_px[0];
      s.v = z.raw_px[1];
      s.sigma_u = std::sqrt(z.cov_px2[0]);
      s.sigma_v = std::sqrt(z.cov_px2[2]);
      s.cov_uv = z.cov_px2[1];
      s.nis = z.nis;
      for (int j = 0; j < truth.n; ++j)
        if (truth.id[static_cast<std::size_t>(j)] != s.id && truth.visible[static_cast<std::size_t>(j)] == truth_t::VISIBLE)
          s.nearest_other_px = std::min(s.nearest_other_px, std::hypot(s.u - truth.u_px[static_cast<std::size_t>(j)], s.v - truth.v_px[static_cast<std::size_t>(j)]));
    }
}

}  // namespace

Result<std::vector<truth_t>> flight_truth(const std::string& flight) {
  std::vector<truth_t> out;
  if (auto whole = FlightReader::open(flight); !whole.ok()) return whole.error();
  auto log = record::EventLog::open((std::filesystem::path(flight) / "messages.lcm").string());
  if (!log.ok()) return log.error();
  record::LogEvent event;
  while (true) {
    const auto more = log->next(event);
    if (!more.ok()) return more.error();
    if (!*more) return out;
    truth_t m;
    if (event.channel != "TRUTH") continue;
    if (!decode(event, m)) return make_error(ErrorCode::kCorrupt, flight + "/messages.lcm", "TRUTH is damaged or of another version of truth_t: make or import the flight again");
    out.push_back(m);
  }
}

double Scored::measured_error() const { return std::hypot(u - true_u, v - true_v); }
double Scored::predicted_error() const { return std::hypot(predicted_u - true_u, predicted_v - true_v); }

Result<Run> load_run(const std::string& flight, const std::string& log) {
  auto published = read_published(log);
  if (!published.ok()) return published.error();
  auto truths = flight_truth(flight);
  if (!truths.ok()) return truths.error();
  Run run;
  for (const auto& [t, m] : *published) {
    if (!m.has_measurement) continue;
    if (run.frames++ == 0) run.t_first_ns = t;
    run.t_last_ns = t;
    run.nav_updates += m.prediction.from_nav ? 1 : 0;
    run.accepted += m.measurement.accepted;
    run.range_m[t] = static_cast<double>(m.prediction.range_m);
  }
  for (const truth_t& truth : *truths) {
    const auto it = published->find(truth.mid_exposure_ns);
    if (it == published->end() || !it->second.has_measurement) continue;
    ++run.frames_with_truth;
    for (int i = 0; i < truth.n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      Scored s;
      s.frame = truth.camera_frame_id;
      s.t_mid_ns = truth.mid_exposure_ns;
      s.id = truth.id[k];
      s.truth = truth.visible[k];
      s.true_u = truth.u_px[k];
      s.true_v = truth.v_px[k];
      s.nav_update = it->second.prediction.from_nav;
      s.range_m = static_cast<double>(it->second.prediction.range_m);
      fill(s, it->second, truth);
      run.scored.push_back(s);
    }
  }
  return run;
}

json summarise(const Run& run) {
  std::vector<double> detection, projection, filter, nis;
  std::int64_t visible = 0, observed = 0, within3 = 0, wrong = 0, dropped = 0, inside95 = 0, hidden_measured = 0, wrong5 = 0;
  for (const Scored& s : run.scored) {
    if (s.truth == 0 && s.measured) ++hidden_measured;
    if (s.truth != 1) continue;
    ++visible;
    if (s.predicted) {
      filter.push_back(s.predicted_error());
      if (s.nav_update) projection.push_back(s.predicted_error());
    }
    if (s.track_state == 0 || s.track_state == 3) ++dropped;
    if (!s.measured) continue;
    ++observed;
    const double e = s.measured_error();
    detection.push_back(e);
    within3 += e < 3.0 ? 1 : 0;
    wrong += s.wrong() ? 1 : 0;
    wrong5 += e > 5.0 ? 1 : 0;
    nis.push_back(s.nis);
    const double du = s.u - s.true_u, dv = s.v - s.true_v;
    const double uu = s.sigma_u * s.sigma_u, vv = s.sigma_v * s.sigma_v, det = uu * vv - s.cov_uv * s.cov_uv;
    if (det > 0 && (vv * du * du - 2 * s.cov_uv * du * dv + uu * dv * dv) / det < 5.991) ++inside95;
  }
  json j;
  j["frames"] = run.frames;
  j["frames_with_truth"] = run.frames_with_truth;
  j["nav_updates"] = run.nav_updates;
  j["features_visible_mean"] = share(visible, run.frames_with_truth);
  j["features_matched_mean"] = share(run.accepted, run.frames);
  j["feature_error_px"] = distribution(detection);
  j["projection_error_px"] = distribution(projection);
  j["filter_error_px"] = distribution(filter);
  j["nis"] = distribution(nis);
  j["share_within_3px"] = share(within3, visible);
  j["share_of_measured_within_3px"] = share(within3, observed);
  j["detection_probability"] = share(observed, visible);
  j["missed_observations"] = visible - observed;
  j["missed_by_dropped_tracks"] = dropped;
  j["misassociated_share"] = share(wrong, observed);
  j["wrong_by_5px_share"] = share(wrong5, observed);
  j["measured_though_hidden"] = hidden_measured;
  j["covariance_95_share"] = share(inside95, observed);
  return j;
}

Result<> write_csv(const Run& run, const std::string& path) {
  std::FILE* f = std::fopen(path.c_str(), "w");
  if (f == nullptr) return make_error(ErrorCode::kIo, path, "cannot be written");
  std::fprintf(f, "frame,t_mid_ns,id,truth,true_u,true_v,nav_update,predicted,predicted_u,predicted_v,measured,u,v,sigma_u,sigma_v,nis,track_state,track_change,range_m\n");
  for (const Scored& s : run.scored)
    std::fprintf(f, "%lld,%lld,%d,%d,%.4f,%.4f,%d,%d,%.4f,%.4f,%d,%.4f,%.4f,%.4f,%.4f,%.4f,%d,%d,%.3f\n", static_cast<long long>(s.frame),
                 static_cast<long long>(s.t_mid_ns), s.id, s.truth, s.true_u, s.true_v, s.nav_update, s.predicted, s.predicted_u, s.predicted_v,
                 s.measured, s.u, s.v, s.sigma_u, s.sigma_v, s.nis, s.track_state, s.track_change, s.range_m);
  if (std::fclose(f) != 0) return make_error(ErrorCode::kIo, path, "cannot be written whole");
  return Ok{};
}

}  // namespace cyclops::tools
