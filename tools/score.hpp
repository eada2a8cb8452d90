#pragma once
/// Compares what the service published with the truth of a flight. Metrics of spec 4.1; all errors radial, raw pixels.
///
/// projection error  navigation's prediction against truth, at navigation updates
/// filter error      prediction in use before the frame was looked at, against truth
/// detection error   accepted measurement against truth; only features that truth calls visible
/// misassociated     a measurement that is nearer to another true feature, or more than 5 px off
/// dropped           visible feature without a live track; missed: visible feature without a measurement
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <cyclops/truth_t.hpp>
#include <nlohmann/json.hpp>

#include "base/result.hpp"

namespace cyclops::tools {

struct Scored {                 ///< one feature in one frame
  std::int64_t frame{0};        ///< camera frame id
  std::int64_t t_mid_ns{0};
  std::int32_t id{0};
  int truth{0};                 ///< truth_t: 0 hidden, 1 visible, 2 do not score
  double true_u{0}, true_v{0};
  bool predicted{false};
  bool nav_update{false};
  double predicted_u{0}, predicted_v{0};
  bool measured{false};         ///< accepted
  double u{0}, v{0};
  double sigma_u{0}, sigma_v{0}, cov_uv{0};
  double nis{0};
  int track_state{0};           ///< track_t: 0 none, 1 live, 2 coasting, 3 deleted
  int track_change{0};
  double range_m{0};
  double nearest_other_px{1e9};  ///< measurement to the nearest other true feature

  [[nodiscard]] double measured_error() const;
  [[nodiscard]] double predicted_error() const;
  [[nodiscard]] bool wrong() const { return measured_error() > 5.0 || nearest_other_px < measured_error(); }
};

struct Run {                    ///< what a log of published messages says
  std::vector<Scored> scored;
  std::map<std::int64_t, double> range_m;
  std::int64_t frames{0};       ///< frames with a measurement set
  std::int64_t nav_updates{0};
  std::int64_t accepted{0};
  std::int64_t frames_with_truth{0};
  std::int64_t t_first_ns{0}, t_last_ns{0};
};

/// n, mean, median, p95, p99 and max; zeros when there is no value.
nlohmann::json distribution(std::vector<double> values);
/// All of a flight's TRUTH, in the order of the log. Error: not a flight, or truth of another version.
Result<std::vector<truth_t>> flight_truth(const std::string& flight);

/// `flight`: folder with TRUTH; `log`: event log with FRAME, PREDICTION, MEASUREMENT, TRACK.
Result<Run> load_run(const std::string& flight, const std::string& log);

/// The summary described in docs/report.md; no service or replay figures in it.
nlohmann::json summarise(const Run& run);

Result<> write_csv(const Run& run, const std::string& path);

}  // namespace cyclops::tools
