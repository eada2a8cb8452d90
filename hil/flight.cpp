#include "hil/flight.hpp"

#include <filesystem>
#include <numbers>

#include <cyclops/time_mark_t.hpp>
#include <cyclops/truth_t.hpp>

#include "base/file.hpp"
#include "hil/flight_figures.hpp"
#include "hil/flight_pictures.hpp"
#include "hil/flight_rig.hpp"
#include "hil/navigation_errors.hpp"
#include "hil/noise.hpp"
#include "hil/smooth.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kCourseRate_hz = 4;
constexpr double kMostCourse = 100;  // times the drawn errors

double interpolated(const std::vector<double>& at, const std::vector<double>& value, double x) {
  if (x <= at.front()) return value.front();
  for (std::size_t i = 1; i < at.size(); ++i)
    if (x < at[i]) return value[i - 1] + (value[i] - value[i - 1]) * (x - at[i - 1]) / (at[i] - at[i - 1]);
  return value.back();
}

/// The half of a flight that a seed of navigation makes.
class NavigationHalf {
 public:
  explicit NavigationHalf(const FlightScene& scene)
      : scene_(scene), n_(scene.scenario.navigation), seed_(key(static_cast<std::uint64_t>(n_.seed), 0x4E41)), errors_(n_, key(seed_, 3), samples()), told_{scene.true_place, n_.is_true ? 0 : n_.boresight_sigma_deg, {}} {
    if (!n_.is_true) {
      const auto drawn = [&](std::uint64_t what, double sigma) {
        return Vec3(sigma * Vec3(normal(key(seed_, what, 0)), normal(key(seed_, what, 1)), normal(key(seed_, what, 2))));
      };
      told_.place.R_c_r = Rotation<frame::C, frame::C>(so3_exp(drawn(5, n_.boresight_sigma_deg * kDeg))) * told_.place.R_c_r;
      told_.place.lens_in_receiver_m += drawn(6, n_.lever_arm_sigma_m);
      told_.points.receiver_ins_from_tspi_m = drawn(7, n_.lever_arm_sigma_m);
      told_.points.tanker_ins_from_tspi_m = drawn(8, n_.lever_arm_sigma_m);
    }
    told_.points.receiver_ins_from_tspi_m -= n_.receiver_point_m;
    told_.points.tanker_ins_from_tspi_m -= n_.tanker_point_m;
    if (!n_.error_px.empty() && !n_.is_true) errors_.set_course(fitted_course());
  }

  [[nodiscard]] std::string rig() const { return rig_toml(scene_, told_); }

  void say(ArrivalQueue& queue) const {
    const std::size_t n = samples();
    const Link receiver{n_.latency_ms, n_.latency_jitter_ms, 0, 0, 0, 0};
    const Link tanker{n_.latency_ms + n_.link_latency_ms, n_.latency_jitter_ms, n_.dropouts_per_minute, n_.dropout_s, n_.duplicate_share, n_.swapped_share};
    const auto own = arrivals(receiver, n_.rate_hz, kServiceStart_ns, n, key(seed_, 9)), linked = arrivals(tanker, n_.rate_hz, kServiceStart_ns, n, key(seed_, 10));
    for (std::size_t k = 0; k < n; ++k) {
      const double t = sample_s(k);
      const Said said = errors_.said(scene_.motion.receiver(t), scene_.motion.tanker(t), k);
      for (std::int64_t at : own[k]) queue.add(at, "TSPI_RECEIVER", tspi_message(0, kGpsStart_ns + to_ns(t), static_cast<int>(k), said.receiver));
      for (std::int64_t at : linked[k]) queue.add(at, "TSPI_TANKER", tspi_message(1, kGpsStart_ns + to_ns(t), static_cast<int>(k), said.tanker));
    }
    for (int second = 0; second <= static_cast<int>(sample_s(n - 1)); ++second) {
      time_mark_t m{};
      m.service_time_ns = kServiceStart_ns + second * 1'000'000'000LL;
      m.gps_time_ns = kGpsStart_ns + second * 1'000'000'000LL;
      m.sigma_ns = 1000;
      m.source = time_mark_t::PPS;
      queue.add(m.service_time_ns, "TIME_MARK", m);
    }
  }

  /// Features that truth calls visible, at the sample nearest to the frame.
  void figure(const truth_t& truth, ProjectionFigures& out) const {
    const auto k = nearest(static_cast<double>(truth.mid_exposure_ns - kServiceStart_ns) * 1e-9);
    const AircraftState r = scene_.motion.receiver(sample_s(k)), t = scene_.motion.tanker(sample_s(k));
    const auto real = scene_.camera_from_model(relative(r, t), scene_.true_place), said = projection(errors_.said(r, t, k));
    for (const Feature& f : scene_.model.features()) {
      bool visible = false;
      for (std::size_t i = 0; i < truth.id.size(); ++i) visible |= truth.id[i] == f.id && truth.visible[i] == truth_t::VISIBLE;
      if (!visible || !f.enabled) continue;
      const auto a = scene_.camera.project(real * f.p_m), b = scene_.camera.project(said * f.p_m);
      if (a && b) out.add(f.id, (*a - *b).norm());
    }
    out.end_frame();
  }

 private:
  [[nodiscard]] double sample_s(std::size_t k) const { return static_cast<double>(k) / n_.rate_hz; }
  [[nodiscard]] std::size_t samples() const {
    return static_cast<std::size_t>((scene_.start_s(scene_.scenario.frames) + kTail_s + (n_.latency_ms + n_.link_latency_ms + n_.latency_jitter_ms) * 1e-3) * n_.rate_hz) + 1;
  }
  [[nodiscard]] std::size_t nearest(double t) const { return std::min(samples() - 1, static_cast<std::size_t>(std::lround(std::max(0.0, t * n_.rate_hz)))); }

  /// The tanker where the service will put it: what is said, through the rig file.
  [[nodiscard]] Pose<frame::C, frame::M> projection(const Said& said) const {
    Said at_ins = said;
    at_ins.receiver.position_e += said.receiver.R_e_b * told_.points.receiver_ins_from_tspi_m;
    at_ins.tanker.position_e += said.tanker.R_e_b * told_.points.tanker_ins_from_tspi_m;
    return scene_.camera_from_model(relative(at_ins.receiver, at_ins.tanker), told_.place);
  }

  /// Mean over the features in the picture at one time; 0 when there is none.
  [[nodiscard]] double error_px(std::size_t k, const AircraftState& r, const AircraftState& t, double scale) const {
    const auto real = scene_.camera_from_model(relative(r, t), scene_.true_place), said = projection(errors_.said_at_scale(r, t, k, scale));
    double sum = 0;
    int n = 0;
    for (const Feature& f : scene_.model.features()) {
      const auto a = scene_.camera.project(real * f.p_m), b = scene_.camera.project(said * f.p_m);
      if (!f.enabled || !a || !b || !scene_.camera.inside(*a)) continue;
      sum += (*a - *b).norm();
      ++n;
    }
    return n > 0 ? sum / n : 0;
  }

  /// What the drawn errors are multiplied by so that their mean on the image takes the scenario's course.
  [[nodiscard]] std::vector<double> fitted_course() const {
    std::vector<Eigen::Matrix<double, 1, 1>> control;
    const double end = sample_s(samples() - 1) + 4 / kCourseRate_hz, first = -4 / kCourseRate_hz;
    double scale = 1;
    const Wander spread({n_.error_spread, 0.15, 0.7}, key(seed_, 11));
    for (double t = first; t <= end; t += 1 / kCourseRate_hz) {
      const double wanted = interpolated(n_.error_at_s, n_.error_px, t - scene_.mid_s(0)) * std::exp(spread.at(t) - 0.5 * n_.error_spread * n_.error_spread);
      const std::size_t k = nearest(t);
      const AircraftState r = scene_.motion.receiver(sample_s(k)), tanker = scene_.motion.tanker(sample_s(k));
      for (int pass = 0; pass < 12; ++pass) {
        const double now = error_px(k, r, tanker, scale);
        if (now <= 0) break;  // nothing in the picture: as before
        scale = std::clamp(scale * std::clamp(wanted / now, 0.1, 10.0), 1e-3, kMostCourse);
      }
      control.emplace_back(scale);
    }
    const Smooth<1> smooth(first, kCourseRate_hz, std::move(control));
    std::vector<double> out(samples());
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = smooth.at(sample_s(k)).value[0];
    return out;
  }

  const FlightScene& scene_;
  const Navigation& n_;
  std::uint64_t seed_;
  NavigationErrors errors_;
  ToldRig told_;
};

/// Adds the messages of the pictures and looks at each truth on the way.
Result<> take_over(const std::string& pictures, ArrivalQueue& queue, const NavigationHalf& navigation, ProjectionFigures& figures) {
  auto flight = FlightReader::open(pictures);
  if (!flight.ok()) return flight.error();
  record::LogEvent e;
  while (true) {
    auto more = flight->next(e);
    if (!more.ok()) return more.error();
    if (!*more) return Ok{};
    queue.add(e.time_us * 1000, e.channel, e.data);
    truth_t truth{};
    if (e.channel == "TRUTH" && truth.decode(e.data.data(), 0, static_cast<int>(e.data.size())) >= 0) navigation.figure(truth, figures);
  }
}

Result<FlightReport> put_together(const FlightScene& scene, const Pictures& pictures, const FlightOptions& options) {
  const std::filesystem::path from(pictures.folder);
  auto created = FlightWriter::create(options.out, options.replace, (from / "frames.lcm").string());
  if (!created.ok()) return created.error();
  FlightWriter out = std::move(created).value();
  const NavigationHalf navigation(scene);
  ArrivalQueue queue;
  navigation.say(queue);
  ProjectionFigures projection;
  CYCLOPS_TRY(take_over(pictures.folder, queue, navigation, projection));
  CYCLOPS_TRY(queue.write(out));
  auto table = read_file(scene.scenario.tanker), picture = read_file((from / "picture.json").string());
  if (!table.ok()) return table.error();
  if (!picture.ok()) return picture.error();
  nlohmann::json figures = nlohmann::json::parse(*picture, nullptr, false);
  if (figures.is_discarded()) return make_error(ErrorCode::kCorrupt, (from / "picture.json").string(), "is no JSON");
  figures["navigation"] = scene.scenario.navigation.is_true ? "true" : "measured";
  figures["seed"] = scene.scenario.navigation.seed;
  figures["projection_error"] = projection.json();
  CYCLOPS_TRY(out.text("tanker.csv", *table));
  CYCLOPS_TRY(out.text("rig.toml", navigation.rig()));
  CYCLOPS_TRY(out.text("figures.json", figures.dump(1) + "\n"));
  if (!scene.camera.windscreen().empty()) {
    auto said = said_windscreen(scene);
    if (!said.ok()) return said.error();
    CYCLOPS_TRY(said->save(out.path("windscreen.bin")));
  }
  CYCLOPS_TRY(out.finish(flight_manifest(scene, options.source)));
  FlightReport report;
  report.projection_error_px = projection.mean_px();
  report.motion_px = figures["motion_px_a_frame"].value("mean", 0.0);
  report.visible = figures["features_visible"].value("mean", 0.0);
  report.doubtful = figures.value("features_not_scored", 0.0);
  report.rendered = pictures.rendered;
  report.render_s = pictures.render_s;
  return report;
}

}  // namespace

Result<FlightReport> make_flight(const Scenario& scenario, const FlightOptions& options) {
  std::error_code ignored;
  const std::filesystem::path out = std::filesystem::absolute(options.out).lexically_normal();
  if (!options.replace && std::filesystem::exists(out / "manifest.toml", ignored)) return make_error(ErrorCode::kInvalid, options.out, "is a flight already");
  auto scene = FlightScene::load(scenario);
  if (!scene.ok()) return scene.error();
  PictureOptions pictures;
  pictures.cache = options.cache.empty() ? ((out.has_filename() ? out : out.parent_path()).parent_path() / "cache").string() : options.cache;
  pictures.threads = options.threads;
  pictures.progress = options.progress;
  pictures.stop = options.stop;
  const auto made = make_pictures(**scene, pictures);
  if (!made.ok()) return made.error();
  return put_together(**scene, *made, options);
}

}  // namespace cyclops::hil
