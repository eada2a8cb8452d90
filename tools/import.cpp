#include "tools/import.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <utility>

#include <cyclops/frame_index_t.hpp>
#include <cyclops/strobe_edge_t.hpp>
#include <cyclops/time_mark_t.hpp>
#include <cyclops/truth_t.hpp>

#include "hil/flight_messages.hpp"
#include "record/flight.hpp"
#include "tools/import_readers.hpp"
#include "wire/channels.hpp"

namespace cyclops::tools {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kServiceStart_ns = 1'000'000'000'000;      // service clock at timestamp 0: a host up for 1000 s
constexpr std::int64_t kGpsStart_ns = 1'400'000'000'000'000'000;  // GPS time of the same instant, May 2024
constexpr std::int64_t kCameraStart_ns = 77'000'000'000;          // camera clock of the same instant
constexpr std::int64_t kExposure_ns = 1'000'000;
constexpr std::int64_t kFirstPacket_ns = 1'000'000;               // after the end of exposure
constexpr std::int64_t kReadout_ns = 8'000'000;                   // end of exposure to last packet
constexpr std::int64_t kTspiLatency_ns = 2'000'000;
constexpr std::int64_t kMarkLead_ns = 100'000'000;                // first time mark before the first frame
constexpr std::int64_t kMarkPeriod_ns = 1'000'000'000;
constexpr double kLatitude_deg = 35, kLongitude_deg = -118, kHeight_m = 3000, kSpeed_mps = 100;
constexpr double kSurveyShare = 0.001;  // of the model's radius: a survey as good as that of the thesis' tanker, roughly

/// The sphere about the mean feature, model frame, m.
struct Extent {
  Vec3 middle{Vec3::Zero()};
  double radius{0};
  explicit Extent(const TankerModel& model) {
    for (const Feature& f : model.features()) middle += f.p_m.xyz / static_cast<double>(model.features().size());
    for (const Feature& f : model.features()) radius = std::max(radius, (f.p_m.xyz - middle).norm());
  }
};

/// Where the receiver is at timestamp t; it flies straight, so its axes stay.
struct Receiver {
  std::int64_t start_ns;
  Vec3 start_e, velocity_e;
  Mat3 R_e_r;
  explicit Receiver(std::int64_t first_frame_ns) : start_ns(first_frame_ns) {
    const hil::Local at = hil::local_from_geodetic(kLatitude_deg, kLongitude_deg, kHeight_m);
    start_e = at.ecef;
    R_e_r = at.R_e_n;
    velocity_e = R_e_r.col(0) * kSpeed_mps;
  }
  [[nodiscard]] hil::AircraftState at(std::int64_t t_ns) const {
    const Vec3 here = start_e + velocity_e * (static_cast<double>(t_ns - start_ns) * 1e-9);
    return {here, velocity_e, R_e_r, Vec3::Zero(), Vec3::Constant(1e-6), 0.05, Vec3::Constant(1e-7)};
  }
};

/// Times of one frame since timestamp 0, as the camera and the strobe know it.
struct Capture {
  std::int64_t id;      // the camera counts from 1
  std::int64_t mid_ns;  // of the exposure
  [[nodiscard]] std::int64_t start_ns() const { return mid_ns - kExposure_ns / 2; }
  [[nodiscard]] std::int64_t end_ns() const { return mid_ns + kExposure_ns / 2; }
  [[nodiscard]] std::int64_t arrival_ns() const { return end_ns() + kReadout_ns; }
};

/// The interval of the flagged frames when it is regular, else 1.
int nav_interval(const std::vector<PriorPose>& prior) {
  std::int64_t last = -1, interval = 0;
  for (const PriorPose& p : prior) {
    if (!p.nav_update) continue;
    if (last >= 0 && interval != 0 && p.frame - last != interval) return 1;
    if (last >= 0) interval = p.frame - last;
    last = p.frame;
  }
  return interval < 1 ? 1 : static_cast<int>(interval);
}

/// Mean over the prior.
double frame_period_s(const std::vector<PriorPose>& prior, double rate_hz) {
  if (prior.size() < 2) return 1 / rate_hz;
  return static_cast<double>(prior.back().t_ns - prior.front().t_ns) * 1e-9 / static_cast<double>(prior.back().frame - prior.front().frame);
}

/// One folder on its way into one flight.
class Import {
 public:
  /// The last two must outlive this.
  Import(FlightWriter out, const ImportOptions& options, const Folder& folder)
      : options_(options), folder_(folder), extent_(folder.model), receiver_(folder.prior.front().t_ns), out_(std::move(out)) {
    report_.width = folder.k.width;
    report_.height = folder.k.height;
    report_.features = folder.model.features().size();
    report_.has_truth = folder.truth.has_value();
    report_.nav_every_n = nav_interval(folder.prior);
    report_.sigma_px = options.prior_sigma_px > 0 ? options.prior_sigma_px : estimate_sigma_px(folder.prior, Camera(folder.k, {}), Point<frame::M>(extent_.middle));
  }
  Result<ImportReport> run();

 private:
  void add_time_marks();
  Result<> add_frame(const PriorPose& p);
  Result<GreyPicture> picture_of(const PriorPose& p);
  Result<std::int64_t> write_pixels(const Capture& capture, const GreyPicture& picture);
  void add_strobe(const Capture& capture);
  Result<> add_tspi(const Capture& capture, const PriorPose& p);
  [[nodiscard]] Vec3 middle_in_camera(const PriorPose& p) const { return (p.T_c_m * Point<frame::M>(extent_.middle)).xyz; }
  [[nodiscard]] hil::AircraftState tanker(const PriorPose& p, const hil::AircraftState& receiver) const;
  void add_index(const Capture& capture, std::int64_t recorded_at);
  void add_truth(const Capture& capture, std::int64_t frame);
  [[nodiscard]] PixelFormat format() const { return report_.sixteen_bit ? PixelFormat::kMono16 : PixelFormat::kMono8; }
  [[nodiscard]] std::string rig_toml() const;
  [[nodiscard]] FlightManifest manifest() const;
  /// `arrival_ns` since timestamp 0.
  template <class M>
  void add(std::int64_t arrival_ns, const char* channel, const M& message) { messages_.add(kServiceStart_ns + arrival_ns, channel, message); }

  const ImportOptions& options_;
  const Folder& folder_;
  Extent extent_;
  Receiver receiver_;
  FlightWriter out_;
  hil::ArrivalQueue messages_;
  ImportReport report_;
};

Result<ImportReport> Import::run() {
  add_time_marks();
  for (const PriorPose& p : folder_.prior) CYCLOPS_TRY(add_frame(p));
  CYCLOPS_TRY(messages_.write(out_));
  CYCLOPS_TRY(out_.text("tanker.csv", folder_.features_csv));
  CYCLOPS_TRY(out_.text("rig.toml", rig_toml()));
  CYCLOPS_TRY(out_.finish(manifest()));
  return report_;
}

void Import::add_time_marks() {
  for (std::int64_t t = folder_.prior.front().t_ns - kMarkLead_ns; t < folder_.prior.back().t_ns; t += kMarkPeriod_ns) {
    time_mark_t m{};
    m.service_time_ns = kServiceStart_ns + t;
    m.gps_time_ns = kGpsStart_ns + t;
    m.sigma_ns = 1000;
    m.source = time_mark_t::RECORDED;
    add(t, channel::kTimeMark, m);
  }
}

Result<> Import::add_frame(const PriorPose& p) {
  auto picture = picture_of(p);
  if (!picture.ok()) return picture.error();
  const Capture capture{report_.frames + 1, p.t_ns};
  auto recorded_at = write_pixels(capture, *picture);
  if (!recorded_at.ok()) return recorded_at.error();
  add_strobe(capture);
  CYCLOPS_TRY(add_tspi(capture, p));
  add_index(capture, *recorded_at);
  add_truth(capture, p.frame);
  ++report_.frames;
  return Ok{};
}

/// The first picture tells the bits of all.
Result<GreyPicture> Import::picture_of(const PriorPose& p) {
  const auto file = folder_.pictures.find(p.frame);
  if (file == folder_.pictures.end()) return make_error(ErrorCode::kNotFound, options_.folder + "/frames", "no picture for frame " + std::to_string(p.frame) + " of the prior");
  auto picture = read_picture(file->second, folder_.k);
  if (!picture.ok()) return picture;
  const bool sixteen = picture->samples.depth() == CV_16U;
  if (report_.frames == 0) report_.sixteen_bit = sixteen;
  if (sixteen != report_.sixteen_bit) return make_error(ErrorCode::kInvalid, file->second, "has another number of bits than the frames before");
  report_.from_colour = report_.from_colour || picture->from_colour;
  return picture;
}

Result<std::int64_t> Import::write_pixels(const Capture& capture, const GreyPicture& picture) {
  const cv::Mat& samples = picture.samples;
  FlightFrame frame;
  frame.camera_frame_id = static_cast<std::uint64_t>(capture.id);
  frame.camera_tick_ns = kCameraStart_ns + capture.start_ns();
  frame.exposure = Duration{kExposure_ns};
  frame.image = {samples.data, samples.cols, samples.rows, static_cast<int>(samples.step[0]), format()};
  return out_.frame(Time{kServiceStart_ns + capture.arrival_ns()}, frame);
}

void Import::add_strobe(const Capture& capture) {
  strobe_edge_t edge{};
  edge.service_time_ns = kServiceStart_ns + capture.start_ns();
  edge.line_seq = capture.id;
  edge.edge = strobe_edge_t::RISING;
  add(capture.start_ns(), channel::kStrobe, edge);
}

Result<> Import::add_tspi(const Capture& capture, const PriorPose& p) {
  if (!(middle_in_camera(p).z() > 0))
    return make_error(ErrorCode::kInvalid, options_.prior, "frame " + std::to_string(p.frame) + ": the model is behind the camera");
  const hil::AircraftState receiver = receiver_.at(p.t_ns);
  const std::int64_t heard = capture.mid_ns + kTspiLatency_ns, gps = kGpsStart_ns + capture.mid_ns;
  const int seq = static_cast<int>(capture.id - 1);
  add(heard, channel::kTspiReceiver, hil::tspi_message(0, gps, seq, receiver));
  add(heard, channel::kTspiTanker, hil::tspi_message(1, gps, seq, tanker(p, receiver)));
  return Ok{};
}

/// T_r_k = T_c_r^-1 T_c_m T_m_k, with p_m = flip p_k + middle. Sigmas as import.hpp says.
hil::AircraftState Import::tanker(const PriorPose& p, const hil::AircraftState& receiver) const {
  const Mat3 R_c_r = camera_from_receiver({}).matrix();
  const Eigen::DiagonalMatrix<double, 3> flip(-1, 1, -1);
  const Vec3 middle_c = middle_in_camera(p);
  const Mat3 R_r_k = R_c_r.transpose() * p.T_c_m.rotation().matrix() * flip;
  const Vec3 t_r_k = R_c_r.transpose() * middle_c;
  const double lateral = report_.sigma_px * middle_c.z() / folder_.k.fx_px;
  const double turn = 0.5 * lateral / std::max(extent_.radius, 1e-9);
  const Mat3& R_e_r = receiver.R_e_b;
  return {receiver.position_e + R_e_r * t_r_k, receiver.velocity_e, R_e_r * R_r_k, Vec3::Zero(), {3 * lateral, lateral, lateral}, 0.05, Vec3::Constant(std::min(turn, 0.5))};
}

void Import::add_index(const Capture& capture, std::int64_t recorded_at) {
  frame_index_t index{};
  index.seq = capture.id;
  index.camera_frame_id = capture.id;
  index.mid_exposure_ns = kServiceStart_ns + capture.mid_ns;
  index.camera_tick_ns = kCameraStart_ns + capture.start_ns();
  index.arrival_ns = kServiceStart_ns + capture.end_ns() + kFirstPacket_ns;
  index.exposure_ns = kExposure_ns;
  index.status = frame_index_t::COMPLETE;
  index.time_source = frame_index_t::TIME_STROBE;
  index.pixel_format = static_cast<std::int8_t>(format());
  index.width_px = static_cast<std::int16_t>(folder_.k.width);
  index.height_px = static_cast<std::int16_t>(folder_.k.height);
  index.recorded_in = "frames.lcm";
  index.recorded_at = recorded_at;
  add(capture.arrival_ns(), channel::kFrame, index);
}

void Import::add_truth(const Capture& capture, std::int64_t frame) {
  if (!folder_.truth) return;
  const auto points = folder_.truth->find(frame);
  if (points == folder_.truth->end()) {
    ++report_.frames_without_truth;
    return;
  }
  truth_t t{};
  t.camera_frame_id = capture.id;
  t.mid_exposure_ns = kServiceStart_ns + capture.mid_ns;
  t.n = static_cast<std::int32_t>(points->second.size());
  for (const TruthPoint& point : points->second) {
    t.id.push_back(point.id);
    t.u_px.push_back(point.u_px);
    t.v_px.push_back(point.v_px);
    t.visible.push_back(static_cast<std::int8_t>(point.visible));
  }
  add(capture.arrival_ns(), channel::kTruth, t);
}

std::string Import::rig_toml() const {
  const Intrinsics& k = folder_.k;
  const Vec3& middle = extent_.middle;
  const double rate_hz = std::round(1e6 / frame_period_s(folder_.prior, options_.rate_hz)) * 1e-6;
  std::ostringstream o;
  o.precision(17);
  o << "# Made by cyclops-import. The camera looks along the receiver's nose from the receiver's INS.\n[camera]\naddress = \"127.0.0.1\"\n"
    << "width_px = " << k.width << "\nheight_px = " << k.height << "\npixel_format = \"" << (report_.sixteen_bit ? "mono16" : "mono8") << "\"\nframe_rate_hz = " << rate_hz
    << "\nexposure_us = " << static_cast<double>(kExposure_ns) * 1e-3 << "\nfx_px = " << k.fx_px << "\nfy_px = " << k.fy_px << "\ncx_px = " << k.cx_px
    << "\ncy_px = " << k.cy_px << "\npitch_um = 10.0  # not known; only scales Z(t)\nk1 = " << k.k1 << "\nk2 = " << k.k2 << "\np1 = " << k.p1 << "\np2 = " << k.p2
    << "\nk3 = " << k.k3 << "\n[mount]\npan_deg = 0.0\ntilt_deg = 0.0\nroll_deg = 0.0\nlens_in_receiver_m = [0.0, 0.0, 0.0]\nboresight_sigma_deg = 0.0\n"
    << "[tanker]\nmodel = \"tanker.csv\"\nunit = \"m\"\nins = [" << middle.x() << ", " << middle.y() << ", " << middle.z() << "]\nsigma = " << kSurveyShare * extent_.radius << "  # where features.csv lists none\n"
    << "[strobe]\nsource = \"socket\"\nsocket = \"@cyclops-strobe\"\nedge = \"rising\"\n";
  return o.str();
}

FlightManifest Import::manifest() const {
  FlightManifest m;
  m.name = fs::weakly_canonical(options_.folder).filename().string();
  m.origin = "imported";
  m.source = "cyclops-import, prior " + fs::path(options_.prior).filename().string();
  m.frames = report_.frames;
  m.first_frame_ns = kServiceStart_ns + folder_.prior.front().t_ns;
  m.last_frame_ns = kServiceStart_ns + folder_.prior.back().t_ns;
  m.nav_every_n = report_.nav_every_n;
  m.has_truth = report_.has_truth;
  return m;
}

}  // namespace

Result<ImportReport> import_folder(const ImportOptions& options) {
  auto folder = read_folder(options);
  if (!folder.ok()) return folder.error();
  auto out = FlightWriter::create(options.out, options.replace);
  if (!out.ok()) return out.error();
  return Import(std::move(out).value(), options, *folder).run();
}

}  // namespace cyclops::tools
