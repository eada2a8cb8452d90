#include "hil/flight.hpp"

#include <chrono>
#include <cmath>
#include <sstream>
#include <thread>

#include <cyclops/frame_index_t.hpp>
#include <cyclops/strobe_edge_t.hpp>
#include <cyclops/time_mark_t.hpp>
#include <cyclops/truth_t.hpp>

#include "base/file.hpp"
#include "hil/made_up_windscreen.hpp"
#include "hil/motion.hpp"
#include "hil/noise.hpp"

namespace cyclops::hil {
namespace {

constexpr std::int64_t kServiceStart_ns = 1'000'000'000'000;      // service clock at the flight's time 0: a host up for 1000 s
constexpr std::int64_t kGpsStart_ns = 1'400'000'000'000'000'000;  // GPS time of the same instant
constexpr std::int64_t kCameraStart_ns = 77'000'000'000;          // camera clock of the same instant
constexpr double kFirstFrame_s = 0.5, kTail_s = 0.3;              // TSPI begins before the frames and goes on after them
constexpr double kDeg = 3.14159265358979323846 / 180;

std::int64_t ns(double s) { return static_cast<std::int64_t>(std::llround(s * 1e9)); }

class Maker {
 public:
  Maker(const Scenario& s, const FlightOptions& options, TankerModel model, Mesh mesh, Windscreen windscreen)
      : s_(s), options_(options), model_(std::move(model)), seed_(static_cast<std::uint64_t>(s.seed)), camera_(s.camera, std::move(windscreen)),
        renderer_(camera_, std::move(mesh), s.look, key(seed_, 1)), motion_(s, key(seed_, 2)),
        receiver_errors_(s, key(seed_, 3), samples()), tanker_errors_(s, key(seed_, 4), samples()),
        nominal_(camera_from_receiver(s.mount)) {
    for (int i = 0; i < 3; ++i) boresight_[i] = s.boresight_error_deg * kDeg * normal(key(seed_, 5, static_cast<std::uint64_t>(i)));
  }

  Result<FlightReport> run() {
    report_.error_scale = fitted_scale();
    report_.projection_error_px = error_px(report_.error_scale);
    auto created = FlightWriter::create(options_.out, options_.replace);
    if (!created.ok()) return created.error();
    FlightWriter out = std::move(created).value();
    say_navigation();
    CYCLOPS_TRY(say_frames(out));
    CYCLOPS_TRY(queue_.write(out));
    auto table = read_file(s_.tanker);
    if (!table.ok()) return table.error();
    CYCLOPS_TRY(out.text("tanker.csv", *table));
    CYCLOPS_TRY(out.text("rig.toml", rig_toml()));
    if (!camera_.windscreen().empty()) CYCLOPS_TRY(camera_.windscreen().save(out.path("windscreen.bin")));
    CYCLOPS_TRY(out.finish(manifest()));
    return report_;
  }

 private:
  [[nodiscard]] std::size_t samples() const {
    return static_cast<std::size_t>((start_s(s_.frames) + kTail_s + (s_.tspi_latency_ms + s_.tspi_latency_jitter_ms) * 1e-3) * s_.tspi_rate_hz) + 1;
  }
  /// Start of an exposure. The camera keeps its rate by its own clock.
  [[nodiscard]] double start_s(int i) const { return kFirstFrame_s + i / s_.frame_rate_hz / (1 + s_.tick_drift_ppm * 1e-6); }
  [[nodiscard]] double mid_s(int i) const { return start_s(i) + 0.5e-6 * s_.exposure_us; }
  [[nodiscard]] double sample_s(std::size_t k) const { return static_cast<double>(k) / s_.tspi_rate_hz; }

  /// `scale` of the boresight error: 0 gives the mount that the rig file tells.
  [[nodiscard]] Pose<frame::C, frame::M> camera_from_model(const Pose<frame::R, frame::K>& T_r_k, double scale) const {
    const Rotation<frame::C, frame::R> R_c_r = Rotation<frame::C, frame::C>(so3_exp(scale * boresight_)) * nominal_;
    const Pose<frame::C, frame::R> T_c_r(R_c_r, Point<frame::C>(-R_c_r.rotate(s_.lens_in_receiver_m)));
    const Mat3 flip = Eigen::DiagonalMatrix<double, 3>(-1, 1, -1);
    const Pose<frame::K, frame::M> T_k_m(Rotation<frame::K, frame::M>(flip), model_.body_from_model(Point<frame::M>()));
    return T_c_r * T_r_k * T_k_m;
  }

  [[nodiscard]] View view(int i) const {
    const AircraftState r = motion_.receiver(mid_s(i)), k = motion_.tanker(mid_s(i));
    View v;
    v.T_c_m = camera_from_model(relative(r, k), report_.error_scale);
    // camera_from_model of an identity pose turns model to camera; model to receiver body is the flip.
    const Mat3 flip = Eigen::DiagonalMatrix<double, 3>(-1, 1, -1);
    v.R_n_c = local_from_ecef(r.position_e).R_e_n.transpose() * r.R_e_b * flip * camera_from_model(Pose<frame::R, frame::K>(), report_.error_scale).rotation().matrix().transpose();
    v.R_n_m = local_from_ecef(k.position_e).R_e_n.transpose() * k.R_e_b * flip;
    v.frame = static_cast<std::uint64_t>(i);
    return v;
  }

  /// Mean distance on the image between what navigation and rig say and the truth.
  [[nodiscard]] double error_px(double scale) const {
    double sum = 0;
    int n = 0;
    for (int i = 0; i < s_.frames; i += 5) {
      const auto k = std::min(samples() - 1, static_cast<std::size_t>(std::lround(mid_s(i) * s_.tspi_rate_hz)));
      const AircraftState r = motion_.receiver(sample_s(k)), t = motion_.tanker(sample_s(k));
      const auto truth = camera_from_model(relative(r, t), scale);
      const auto said = camera_from_model(relative(receiver_errors_.said(r, k, scale), tanker_errors_.said(t, k, scale)), 0);
      for (const Feature& f : model_.features()) {
        const auto a = camera_.project(truth * f.p_m), b = camera_.project(said * f.p_m);
        if (!f.enabled || !a || !b) continue;
        sum += (*a - *b).norm();
        ++n;
      }
    }
    return n > 0 ? sum / n : 0;
  }

  [[nodiscard]] double fitted_scale() const {
    double scale = 1;
    if (s_.projection_error_px <= 0) return scale;
    for (int pass = 0; pass < 4; ++pass) {
      const double error = error_px(scale);
      if (error <= 0) return 1;
      scale *= s_.projection_error_px / error;
    }
    return scale;
  }

  /// A message is never overtaken by a later one of its aircraft: they come over one link.
  [[nodiscard]] std::int64_t tspi_arrival(std::uint64_t aircraft, std::size_t k, std::int64_t& last) const {
    const double jitter = s_.tspi_latency_jitter_ms * (2 * uniform(key(seed_, 6 + aircraft, k)) - 1);
    last = std::max(kServiceStart_ns + ns(sample_s(k) + (s_.tspi_latency_ms + jitter) * 1e-3), last + 20'000);
    return last;
  }

  void say_navigation() {
    std::int64_t last_receiver = 0, last_tanker = 0;
    for (std::size_t k = 0; k < samples(); ++k) {
      const double t = sample_s(k);
      const int seq = static_cast<int>(k);
      queue_.add(tspi_arrival(0, k, last_receiver), "TSPI_RECEIVER", tspi_message(0, kGpsStart_ns + ns(t), seq, receiver_errors_.said(motion_.receiver(t), k, report_.error_scale)));
      queue_.add(tspi_arrival(1, k, last_tanker), "TSPI_TANKER", tspi_message(1, kGpsStart_ns + ns(t), seq, tanker_errors_.said(motion_.tanker(t), k, report_.error_scale)));
    }
    for (int second = 0; second <= static_cast<int>(sample_s(samples() - 1)); ++second) {
      time_mark_t m{};
      m.service_time_ns = kServiceStart_ns + second * 1'000'000'000LL;
      m.gps_time_ns = kGpsStart_ns + second * 1'000'000'000LL;
      m.sigma_ns = 1000;
      m.source = time_mark_t::PPS;
      queue_.add(m.service_time_ns, "TIME_MARK", m);
    }
  }

  Result<> say_frames(FlightWriter& out) {
    const int batch = std::max(1, options_.threads);
    std::vector<std::vector<std::uint16_t>> pixels(static_cast<std::size_t>(batch));
    std::vector<std::vector<FeatureTruth>> truths(pixels.size());
    std::vector<double> spent_ms(pixels.size());
    for (int first = 0; first < s_.frames; first += batch) {
      const int n = std::min(batch, s_.frames - first);
      const auto work = [&](int k) {
        const auto begin = std::chrono::steady_clock::now();
        const auto at = static_cast<std::size_t>(k);
        const View v = view(first + k);
        renderer_.render(v, pixels[at]);
        truths[at] = renderer_.truth(v, model_);
        spent_ms[at] = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
      };
      std::vector<std::thread> others;
      for (int k = 1; k < n; ++k) others.emplace_back(work, k);
      work(0);
      for (std::thread& t : others) t.join();
      for (int k = 0; k < n; ++k) {
        report_.render_ms += spent_ms[static_cast<std::size_t>(k)] / s_.frames;
        CYCLOPS_TRY(say_frame(out, first + k, pixels[static_cast<std::size_t>(k)], truths[static_cast<std::size_t>(k)]));
      }
      if (options_.progress) options_.progress(first + n, s_.frames);
    }
    return Ok{};
  }

  Result<> say_frame(FlightWriter& out, int i, const std::vector<std::uint16_t>& pixels, const std::vector<FeatureTruth>& truth) {
    const std::int64_t start = ns(start_s(i)), exposure = ns(s_.exposure_us * 1e-6), arrival = kServiceStart_ns + start + exposure + ns(s_.readout_ms * 1e-3);
    const std::int64_t id = i + 1;  // a camera counts from 1
    FlightFrame frame;
    frame.camera_frame_id = static_cast<std::uint64_t>(id);
    frame.camera_tick_ns = kCameraStart_ns + ns(start_s(i) * (1 + s_.tick_drift_ppm * 1e-6));
    frame.exposure = Duration{exposure};
    frame.image = {reinterpret_cast<const std::uint8_t*>(pixels.data()), s_.camera.width, s_.camera.height, 2 * s_.camera.width, PixelFormat::kMono12};
    auto number = out.frame(Time{arrival}, frame);
    if (!number.ok()) return number.error();
    strobe_edge_t edge{};
    edge.service_time_ns = kServiceStart_ns + start;
    edge.line_seq = id;
    edge.edge = strobe_edge_t::RISING;
    queue_.add(edge.service_time_ns, "STROBE", edge);
    frame_index_t index{};
    index.seq = id;
    index.camera_frame_id = id;
    index.mid_exposure_ns = kServiceStart_ns + start + exposure / 2;
    index.camera_tick_ns = frame.camera_tick_ns;
    index.arrival_ns = kServiceStart_ns + start + exposure + 1'000'000;
    index.exposure_ns = exposure;
    index.status = frame_index_t::COMPLETE;
    index.time_source = frame_index_t::TIME_STROBE;
    index.pixel_format = frame_index_t::MONO12;
    index.width_px = static_cast<std::int16_t>(s_.camera.width);
    index.height_px = static_cast<std::int16_t>(s_.camera.height);
    index.recorded_in = "frames.lcm";
    index.recorded_at = *number;
    queue_.add(arrival, "FRAME", index);
    say_truth(i, index.mid_exposure_ns, arrival, truth);
    return Ok{};
  }

  void say_truth(int i, std::int64_t mid_ns, std::int64_t arrival, const std::vector<FeatureTruth>& truth) {
    const auto T_r_k = relative(motion_.receiver(mid_s(i)), motion_.tanker(mid_s(i)));
    const Eigen::Quaterniond q = T_r_k.rotation().quaternion();
    truth_t t{};
    t.camera_frame_id = i + 1;
    t.mid_exposure_ns = mid_ns;
    t.has_pose = 1;
    const double w[4] = {q.w(), q.x(), q.y(), q.z()};
    std::copy(w, w + 4, t.q_r_k);
    for (int a = 0; a < 3; ++a) t.t_r_k_m[a] = T_r_k.translation().xyz[a];
    double moved = 0;
    int n = 0;
    for (std::size_t f = 0; f < truth.size(); ++f) {
      if (!truth[f].in_front) continue;
      t.id.push_back(truth[f].id);
      t.u_px.push_back(truth[f].raw_px.x());
      t.v_px.push_back(truth[f].raw_px.y());
      t.visible.push_back(truth[f].doubtful ? truth_t::DO_NOT_SCORE : truth[f].visible ? truth_t::VISIBLE : truth_t::HIDDEN);
      report_.visible += truth[f].visible && !truth[f].doubtful ? 1.0 / s_.frames : 0;
      report_.doubtful += truth[f].doubtful ? 1.0 / s_.frames : 0;
      if (f < last_.size() && last_[f].in_front) { moved += (truth[f].raw_px - last_[f].raw_px).norm(); ++n; }
    }
    t.n = static_cast<std::int32_t>(t.id.size());
    if (n > 0) report_.motion_px += moved / n / (s_.frames - 1);
    last_ = truth;
    queue_.add(arrival, "TRUTH", t);
  }

  [[nodiscard]] std::string rig_toml() const {
    const Intrinsics& k = s_.camera;
    std::ostringstream o;
    o.precision(17);
    o << "# Made by cyclops-flight, scenario " << s_.name << ".\n[camera]\naddress = \"127.0.0.1\"\nwidth_px = " << k.width << "\nheight_px = " << k.height
      << "\npixel_format = \"mono12\"\nframe_rate_hz = " << s_.frame_rate_hz << "\nexposure_us = " << s_.exposure_us << "\nfx_px = " << k.fx_px << "\nfy_px = " << k.fy_px
      << "\ncx_px = " << k.cx_px << "\ncy_px = " << k.cy_px << "\npitch_um = " << k.pitch_m * 1e6 << "\nk1 = " << k.k1 << "\nk2 = " << k.k2
      << "\np1 = " << k.p1 << "\np2 = " << k.p2 << "\nk3 = " << k.k3 << (camera_.windscreen().empty() ? "" : "\nwindscreen = \"windscreen.bin\"")
      << "\n[mount]\npan_deg = " << s_.mount.pan / kDeg << "\ntilt_deg = " << s_.mount.tilt / kDeg << "\nroll_deg = " << s_.mount.roll / kDeg
      << "\nlens_in_receiver_m = [" << s_.lens_in_receiver_m.x() << ", " << s_.lens_in_receiver_m.y() << ", " << s_.lens_in_receiver_m.z()
      << "]\nboresight_sigma_deg = " << s_.boresight_error_deg << "\n[tanker]\nmodel = \"tanker.csv\"\nunit = \"in\"\nins = [" << s_.ins_in.x() << ", " << s_.ins_in.y() << ", "
      << s_.ins_in.z() << "]\n[strobe]\nsource = \"socket\"\nsocket = \"@cyclops-strobe\"\nedge = \"rising\"\n";
    return o.str();
  }

  [[nodiscard]] FlightManifest manifest() const {
    FlightManifest m;
    m.name = s_.name;
    m.origin = "generated";
    m.source = options_.source;
    m.frames = s_.frames;
    m.first_frame_ns = kServiceStart_ns + ns(mid_s(0));
    m.last_frame_ns = kServiceStart_ns + ns(mid_s(s_.frames - 1));
    m.has_truth = true;
    return m;
  }

  const Scenario& s_;
  const FlightOptions& options_;
  TankerModel model_;
  std::uint64_t seed_;
  Camera camera_;
  Renderer renderer_;
  Motion motion_;
  NavigationErrors receiver_errors_, tanker_errors_;
  Rotation<frame::C, frame::R> nominal_;
  Vec3 boresight_{0, 0, 0};
  ArrivalQueue queue_;
  FlightReport report_{};
  std::vector<FeatureTruth> last_;
};

}  // namespace

Result<FlightReport> make_flight(const Scenario& scenario, const FlightOptions& options) {
  auto model = TankerModel::load(scenario.tanker, 0.0254, scenario.ins_in);
  if (!model.ok()) return model.error();
  auto mesh = c12_mesh(*model);
  if (!mesh.ok()) return mesh.error();
  auto windscreen = made_up_windscreen(scenario.camera.width, scenario.camera.height, scenario.windscreen);
  if (!windscreen.ok()) return windscreen.error();
  return Maker(scenario, options, std::move(model).value(), std::move(mesh).value(), std::move(windscreen).value()).run();
}

}  // namespace cyclops::hil
