#include "tools/learn_trial.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <unistd.h>

#include <cyclops/truth_t.hpp>

#include "record/flight.hpp"
#include "tools/offline.hpp"
#include "tools/score.hpp"
#include "tools/true_pose.hpp"

namespace cyclops::tools::learn {
namespace {

using nlohmann::json;
using TruthByTime = std::map<std::int64_t, truth_t>;

Result<TruthByTime> truth_of(const std::string& folder) {
  auto truths = flight_truth(folder);
  if (!truths.ok()) return truths.error();
  TruthByTime out;
  for (truth_t& t : *truths) out.emplace(t.mid_exposure_ns, std::move(t));
  if (out.empty()) return make_error(ErrorCode::kNotFound, folder + "/messages.lcm", "has no TRUTH, expected a flight that was generated or imported with it");
  return out;
}

Vec3 lens_k(const CameraPose& T_c_k) { return (T_c_k.inverse() * Point<frame::C>{}).xyz; }

struct Errors {
  std::vector<double> px, metres_aligned, metres_measured;
  Vec3 sum_aligned_m{0, 0, 0};  // tanker body axes
  struct ByPoint {
    std::int64_t n{0};
    Vec2 sum_px{0, 0};
    double sum_norm_px{0};
  };
  std::map<FeatureId, ByPoint> by_point;
  std::int64_t measured{0}, frames{0}, consensus{0}, inside95{0}, far{0}, predicted{0};
  double truth_rms_px{0};
};

class Tester {
 public:
  Tester(const Stretch& stretch, const Rig& own, const TruthByTime& truth, std::int64_t first_ns) : stretch_(stretch), own_(own), truth_(truth), first_ns_(first_ns) {}

  void see(const Rig& rig, const FrameOutput& out) {
    const double t_s = static_cast<double>(out.in.frame.t_mid.ns - first_ns_) * 1e-9;
    const auto it = truth_.find(out.in.frame.t_mid.ns);
    if (t_s < stretch_.from_s || t_s > stretch_.to_s || it == truth_.end()) return;
    const CameraPose start = out.alignment.consensus ? out.alignment.T_c_k : last_;
    const auto truth = true_pose(rig.camera, own_.tanker, it->second, start);
    if (!truth) return;
    last_ = truth->T_c_k;
    errors_.truth_rms_px = std::max(errors_.truth_rms_px, truth->rms_px);
    ++errors_.frames;
    measurements(rig, out, truth->T_c_k);
    if (!out.alignment.consensus) return;
    ++errors_.consensus;
    for (const Prediction& p : out.aligned.items) errors_.predicted += p.visibility == Visibility::kVisible ? 1 : 0;
    const Vec3 error = lens_k(out.alignment.T_c_k) - lens_k(truth->T_c_k);
    errors_.metres_aligned.push_back(error.norm());
    errors_.sum_aligned_m += error;
  }

  [[nodiscard]] const Errors& errors() const { return errors_; }

 private:
  void measurements(const Rig& rig, const FrameOutput& out, const CameraPose& truth) {
    std::vector<PointPixel> points;
    for (const Measurement& m : out.measurements.items) {
      if (!m.accepted) continue;
      const Point<frame::K> p_k = rig.tanker.in_body(rig.tanker.features()[m.feature]);
      const auto at = rig.camera.project(truth * p_k);
      if (!at) continue;
      const Vec2 r = m.raw_px - *at;
      ++errors_.measured;
      errors_.px.push_back(r.norm());
      Errors::ByPoint& b = errors_.by_point[m.id];
      ++b.n;
      b.sum_px += r;
      b.sum_norm_px += r.norm();
      errors_.inside95 += r.dot(m.cov_px2.inverse() * r) < 5.991 ? 1 : 0;
      errors_.far += r.norm() > 5 ? 1 : 0;
      points.push_back({p_k, m.raw_px, m.cov_px2});
    }
    if (const auto fitted = fit_pose(rig.camera, points, out.alignment.consensus ? out.alignment.T_c_k : truth, 2.0))
      errors_.metres_measured.push_back((lens_k(fitted->T_c_k) - lens_k(truth)).norm());
  }

  const Stretch& stretch_;
  const Rig& own_;
  const TruthByTime& truth_;
  std::int64_t first_ns_;
  CameraPose last_{};
  Errors errors_;
};

json figures_of(const Errors& e) {
  const Vec3 bias = e.sum_aligned_m / static_cast<double>(std::max<std::int64_t>(1, e.consensus));
  json by_point = json::array();
  for (const auto& [id, b] : e.by_point) {
    const auto n = static_cast<double>(b.n);
    by_point.push_back({{"id", id}, {"measured", b.n}, {"error_px", b.sum_norm_px / n}, {"bias_px", {b.sum_px.x() / n, b.sum_px.y() / n}}});
  }
  const double frames = static_cast<double>(std::max<std::int64_t>(1, e.frames)), measured = static_cast<double>(std::max<std::int64_t>(1, e.measured));
  return {{"frames", e.frames},
          {"consensus_share", static_cast<double>(e.consensus) / frames},
          {"measured_a_frame", static_cast<double>(e.measured) / frames},
          {"predicted_a_frame", static_cast<double>(e.predicted) / std::max(1.0, static_cast<double>(e.consensus))},
          {"error_px", distribution(e.px)},
          {"covariance_95_share", static_cast<double>(e.inside95) / measured},
          {"wrong_by_5px_share", static_cast<double>(e.far) / measured},
          {"aligned_position_error_m", distribution(e.metres_aligned)},
          {"aligned_position_bias_m", {bias.x(), bias.y(), bias.z()}},
          {"measured_position_error_m", distribution(e.metres_measured)},
          {"by_point", by_point},
          {"truth_fit_rms_px", e.truth_rms_px}};
}

}  // namespace

Result<json> try_model(const Stretch& stretch, const std::string& tanker, const std::string& looks, const Profile& profile) {
  auto flight = FlightReader::open(stretch.folder);
  if (!flight.ok()) return flight.error();
  auto own = Rig::load(flight->path("rig.toml"));
  if (!own.ok()) return own.error();
  auto truth = truth_of(stretch.folder);
  if (!truth.ok()) return truth.error();
  Tester tester(stretch, *own, *truth, flight->manifest().first_frame_ns);
  const std::string log = (std::filesystem::temp_directory_path() / ("cyclops-learn-" + std::to_string(getpid()) + ".lcm")).string();
  const auto run = run_offline(stretch.folder, profile, log, {}, [&](const Rig& rig, const FrameOutput& out, const ImageView&) { tester.see(rig, out); }, {.tanker = tanker, .looks = looks, .most_frames = stretch.frames(flight->manifest())});
  std::error_code ignored;
  std::filesystem::remove(log, ignored);
  if (!run.ok()) return run.error();
  json j = figures_of(tester.errors());
  j["flight"] = std::filesystem::path(stretch.folder).filename().string();
  j["model"] = tanker.empty() ? "surveyed" : std::filesystem::path(tanker).filename().string();
  if (!looks.empty()) j["model"] = j["model"].get<std::string>() + "+looks";
  j["chain_p50_us"] = static_cast<double>(run->chain.quantile(0.5).ns) * 1e-3;
  j["chain_p99_us"] = static_cast<double>(run->chain.quantile(0.99).ns) * 1e-3;
  return j;
}

std::string trial_line(const json& j) {
  const auto number = [&](const char* key, const char* part) { return j[key][part].get<double>(); };
  char line[400];
  std::snprintf(line, sizeof line, "%-12s %-16s %5d frames  %5.1f measured  error mean %.2f median %.2f p95 %.2f px  95 %% ellipse %4.1f %%  > 5 px %.2f %%  position median %.1f p95 %.1f cm (measurements alone %.1f, %.1f), bias %.1f %.1f %.1f",
                j["flight"].get<std::string>().c_str(), j["model"].get<std::string>().c_str(), j["frames"].get<int>(), j["measured_a_frame"].get<double>(),
                number("error_px", "mean"), number("error_px", "median"), number("error_px", "p95"), 100 * j["covariance_95_share"].get<double>(),
                100 * j["wrong_by_5px_share"].get<double>(), 100 * number("aligned_position_error_m", "median"), 100 * number("aligned_position_error_m", "p95"),
                100 * number("measured_position_error_m", "median"), 100 * number("measured_position_error_m", "p95"), 100 * j["aligned_position_bias_m"][0].get<double>(),
                100 * j["aligned_position_bias_m"][1].get<double>(), 100 * j["aligned_position_bias_m"][2].get<double>());
  return line;
}

}  // namespace cyclops::tools::learn
