#include "tools/import.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <cyclops/frame_index_t.hpp>
#include <cyclops/strobe_edge_t.hpp>
#include <cyclops/time_mark_t.hpp>
#include <cyclops/truth_t.hpp>
#include <cyclops/tspi_t.hpp>

#include "base/file.hpp"
#include "hil/flight_messages.hpp"
#include "record/flight.hpp"
#include "tools/csv.hpp"

namespace cyclops::tools {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kServiceStart_ns = 1'000'000'000'000;      // service clock at timestamp 0: a host up for 1000 s
constexpr std::int64_t kGpsStart_ns = 1'400'000'000'000'000'000;  // GPS time of the same instant, May 2024
constexpr std::int64_t kCameraStart_ns = 77'000'000'000;          // camera clock of the same instant
constexpr std::int64_t kExposure_ns = 1'000'000;
constexpr std::int64_t kReadout_ns = 8'000'000;                   // end of exposure to last packet
constexpr std::int64_t kTspiLatency_ns = 2'000'000;
constexpr double kMaxTimestamp_s = 2.5e9;                         // seconds since 1970 until 2049
constexpr std::int64_t kLongest_ns = 3'600'000'000'000;           // the receiver flies straight on while the earth curves away
constexpr double kLatitude_deg = 35, kLongitude_deg = -118, kHeight_m = 3000, kSpeed_mps = 100;
constexpr double kRad = 3.14159265358979323846 / 180;

struct World {  // where the receiver is at timestamp t
  std::int64_t start_ns;
  Vec3 start_ecef, velocity_e;
  Mat3 R_e_r;   // constant: it flies straight
  explicit World(std::int64_t first_frame_ns) : start_ns(first_frame_ns) {
    const hil::Local at = hil::local_from_geodetic(kLatitude_deg, kLongitude_deg, kHeight_m);
    start_ecef = at.ecef;
    R_e_r = at.R_e_n;
    velocity_e = R_e_r.col(0) * kSpeed_mps;
  }
  [[nodiscard]] Vec3 position(std::int64_t t_ns) const { return start_ecef + velocity_e * (static_cast<double>(t_ns - start_ns) * 1e-9); }
};

Result<Intrinsics> read_camera(const std::string& path) {
  std::ifstream in(path);
  if (!in) return make_error(ErrorCode::kNotFound, path, "cannot be opened");
  nlohmann::json j;
  try {
    in >> j;
    Intrinsics k;
    const double width = j.at("width").get<double>(), height = j.at("height").get<double>();
    for (const double side : {width, height})
      if (!(side >= 16 && side <= kMaxImageSide) || side != std::floor(side)) return make_error(ErrorCode::kInvalid, path, "width and height must be whole numbers from 16 to 4096");
    k.width = static_cast<int>(width);
    k.height = static_cast<int>(height);
    k.fx_px = j.at("fx").get<double>();
    k.fy_px = j.at("fy").get<double>();
    k.cx_px = j.at("cx").get<double>();
    k.cy_px = j.at("cy").get<double>();
    k.k1 = j.value("k1", 0.0);
    k.k2 = j.value("k2", 0.0);
    k.p1 = j.value("p1", 0.0);
    k.p2 = j.value("p2", 0.0);
    k.k3 = j.value("k3", 0.0);
    if (!(k.fx_px > 0) || !(k.fy_px > 0)) return make_error(ErrorCode::kInvalid, path, "fx and fy must be above 0");
    return k;
  } catch (const nlohmann::json::exception& e) {
    return make_error(ErrorCode::kCorrupt, path, e.what());
  }
}

Result<std::vector<std::string>> list_frames(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(fs::path(folder) / "frames", error)) {
    std::string ext = entry.path().extension().string();
    std::transform(ext.begin(), ext.end(), ext.begin(), [](unsigned char c) { return std::tolower(c); });
    if (ext == ".png" || ext == ".pgm") out.push_back(entry.path().string());
  }
  if (out.empty()) return make_error(ErrorCode::kNotFound, folder + "/frames", "holds no .png or .pgm file");
  std::sort(out.begin(), out.end());
  return out;
}

/// Number at the end of the file name's stem, -1 when there is none.
std::int64_t number_of(const std::string& path) {
  const std::string stem = fs::path(path).stem().string();
  std::size_t a = stem.size();
  while (a > 0 && std::isdigit(static_cast<unsigned char>(stem[a - 1])) != 0) --a;
  return a == stem.size() || stem.size() - a > 15 ? -1 : std::stoll(stem.substr(a));
}

Result<cv::Mat> read_image(const std::string& path, const Intrinsics& k, bool& colour) {
  cv::Mat image;
  try {
    image = cv::imread(path, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {  // a header that speaks of more pixels than OpenCV allows
  }
  if (image.empty()) return make_error(ErrorCode::kCorrupt, path, "is no picture that can be read");
  if (image.channels() != 1) {
    colour = true;
    cv::Mat grey;
    cv::cvtColor(image, grey, image.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
    image = grey;
  }
  if (image.depth() != CV_8U && image.depth() != CV_16U) return make_error(ErrorCode::kUnsupported, path, "has neither 8 nor 16 bits a sample");
  if (image.cols != k.width || image.rows != k.height)
    return make_error(ErrorCode::kInvalid, path, "is " + std::to_string(image.cols) + " x " + std::to_string(image.rows) + " px, expected " + std::to_string(k.width) + " x " + std::to_string(k.height) + " by camera.json");
  return image;
}

struct TruthPoint {
  std::int32_t id;
  double u, v;
  int visible;
};
using TruthByFrame = std::map<std::int64_t, std::vector<TruthPoint>>;

Result<TruthByFrame> read_truth(const std::string& path) {
  auto csv = Csv::load(path);
  if (!csv.ok()) return csv.error();
  auto u = csv->one_of({"u_px", "u"}), v = csv->one_of({"v_px", "v"});
  if (!u.ok()) return u.error();
  if (!v.ok()) return v.error();
  for (const char* need : {"frame", "id"})
    if (auto c = csv->one_of({need}); !c.ok()) return c.error();
  const bool has_visible = csv->has("visible");
  TruthByFrame out;
  for (std::size_t i = 0; i < csv->rows(); ++i) {
    auto frame = csv->whole(i, "frame"), id = csv->whole(i, "id");
    auto x = csv->number(i, *u), y = csv->number(i, *v);
    if (!frame.ok()) return frame.error();
    if (!id.ok()) return id.error();
    if (!x.ok()) return x.error();
    if (!y.ok()) return y.error();
    std::int64_t visible = 1;
    if (has_visible) {
      auto w = csv->whole(i, "visible");
      if (!w.ok()) return w.error();
      if (*w < 0 || *w > 2) return make_error(ErrorCode::kCorrupt, csv->where(i), "visible is " + std::to_string(*w) + ", expected 0, 1 or 2");
      visible = *w;
    }
    if (*id < INT32_MIN || *id > INT32_MAX) return make_error(ErrorCode::kCorrupt, csv->where(i), "id is " + std::to_string(*id) + ", expected a 32-bit number");
    out[*frame].push_back({static_cast<std::int32_t>(*id), *x, *y, static_cast<int>(visible)});
  }
  return out;
}

constexpr double kSurveyShare = 0.001;  // of the model's radius: a survey as good as that of the thesis' tanker, roughly

std::string rig_toml(const Intrinsics& k, const Vec3& middle, double radius, double rate_hz, bool sixteen) {
  std::ostringstream o;
  o.precision(17);
  o << "# Made by cyclops-import. The camera looks along the receiver's nose from the receiver's INS.\n[camera]\naddress = \"127.0.0.1\"\n"
    << "width_px = " << k.width << "\nheight_px = " << k.height << "\npixel_format = \"" << (sixteen ? "mono16" : "mono8") << "\"\nframe_rate_hz = " << rate_hz
    << "\nexposure_us = " << static_cast<double>(kExposure_ns) * 1e-3 << "\nfx_px = " << k.fx_px << "\nfy_px = " << k.fy_px << "\ncx_px = " << k.cx_px
    << "\ncy_px = " << k.cy_px << "\npitch_um = 10.0  # not known; only scales Z(t)\nk1 = " << k.k1 << "\nk2 = " << k.k2 << "\np1 = " << k.p1 << "\np2 = " << k.p2
    << "\nk3 = " << k.k3 << "\n[mount]\npan_deg = 0.0\ntilt_deg = 0.0\nroll_deg = 0.0\nlens_in_receiver_m = [0.0, 0.0, 0.0]\nboresight_sigma_deg = 0.0\n"
    << "[tanker]\nmodel = \"tanker.csv\"\nunit = \"m\"\nins = [" << middle.x() << ", " << middle.y() << ", " << middle.z() << "]\nsigma = " << kSurveyShare * radius << "  # where features.csv lists none\n"
    << "[strobe]\nsource = \"socket\"\nsocket = \"@cyclops-strobe\"\nedge = \"rising\"\n";
  return o.str();
}

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

}  // namespace

Result<std::vector<PriorPose>> read_prior(const std::string& path, double rate_hz) {
  auto csv = Csv::load(path);
  if (!csv.ok()) return csv.error();
  std::array<std::string, 8> names;
  const std::vector<std::vector<std::string>> wanted{{"frame"}, {"x_m", "x"}, {"y_m", "y"}, {"z_m", "z"}, {"qw"}, {"qx"}, {"qy"}, {"qz"}};
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    auto name = csv->one_of(wanted[i]);
    if (!name.ok()) return name.error();
    names[i] = *name;
  }
  std::vector<PriorPose> out;
  for (std::size_t r = 0; r < csv->rows(); ++r) {
    PriorPose p;
    auto frame = csv->whole(r, "frame");
    if (!frame.ok()) return frame.error();
    p.frame = *frame;
    std::array<double, 7> v{};
    for (std::size_t i = 0; i < 7; ++i) {
      auto x = csv->number(r, names[i + 1]);
      if (!x.ok()) return x.error();
      v[i] = *x;
    }
    const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
    if (std::fabs(q.norm() - 1) > 0.01) return make_error(ErrorCode::kCorrupt, csv->where(r), "quaternion has length " + std::to_string(q.norm()) + ", expected 1");
    p.T_c_m = Pose<frame::C, frame::M>(Rotation<frame::C, frame::M>(q), Point<frame::C>(v[0], v[1], v[2]));
    double t_s = static_cast<double>(p.frame) / rate_hz;
    if (csv->has("timestamp_s")) {
      auto t = csv->number(r, "timestamp_s");
      if (!t.ok()) return t.error();
      t_s = *t;
    }
    if (std::fabs(t_s) > kMaxTimestamp_s) return make_error(ErrorCode::kCorrupt, csv->where(r), "timestamp_s is " + std::to_string(t_s) + ", expected at most " + std::to_string(kMaxTimestamp_s) + " from 0");
    p.t_ns = static_cast<std::int64_t>(std::llround(t_s * 1e9));
    if (!out.empty() && p.t_ns - out.front().t_ns > kLongest_ns) return make_error(ErrorCode::kUnsupported, csv->where(r), "more than an hour after the first pose");
    if (!out.empty() && p.t_ns <= out.back().t_ns) return make_error(ErrorCode::kCorrupt, csv->where(r), "time does not go on: " + std::to_string(t_s) + " s after " + std::to_string(static_cast<double>(out.back().t_ns) * 1e-9) + " s");
    if (!out.empty() && p.frame <= out.back().frame) return make_error(ErrorCode::kCorrupt, csv->where(r), "frame " + std::to_string(p.frame) + " after frame " + std::to_string(out.back().frame));
    if (csv->has("nav_update")) {
      auto n = csv->whole(r, "nav_update");
      if (!n.ok()) return n.error();
      p.nav_update = *n != 0;
    }
    out.push_back(p);
  }
  if (out.empty()) return make_error(ErrorCode::kTruncated, path, "holds no pose");
  return out;
}

double estimate_sigma_px(const std::vector<PriorPose>& prior, const Camera& camera, const Point<frame::M>& middle) {
  std::vector<double> second;
  for (std::size_t i = 2; i < prior.size(); ++i) {
    const auto a = camera.project_ideal(prior[i - 2].T_c_m * middle), b = camera.project_ideal(prior[i - 1].T_c_m * middle), c = camera.project_ideal(prior[i].T_c_m * middle);
    if (a && b && c) second.push_back((*a - 2.0 * *b + *c).norm());
  }
  if (second.size() < 8) return 6.0;
  std::nth_element(second.begin(), second.begin() + static_cast<std::ptrdiff_t>(second.size() / 2), second.end());
  // Rayleigh median 1.1774 sigma; second difference of white noise has 6 times its variance; white is a fifth of the whole.
  const double white = second[second.size() / 2] / 1.1774 / std::sqrt(6.0);
  return std::clamp(white * std::sqrt(5.0), 1.5, 15.0);
}

Result<ImportReport> import_folder(const ImportOptions& options) {
  ImportReport report;
  const fs::path root(options.folder);
  auto k = read_camera((root / "camera.json").string());
  if (!k.ok()) return k.error();
  const std::string features_path = (root / "features.csv").string();
  auto features_text = read_file(features_path);
  if (!features_text.ok()) return features_text.error();
  auto model = TankerModel::parse(*features_text, features_path, 1.0, Vec3::Zero());
  if (!model.ok()) return model.error();
  auto prior = read_prior(fs::path(options.prior).is_absolute() || fs::exists(options.prior) ? options.prior : (root / options.prior).string(), options.rate_hz);
  if (!prior.ok()) return prior.error();
  auto files = list_frames(options.folder);
  if (!files.ok()) return files.error();
  std::map<std::int64_t, std::string> picture;
  for (std::size_t i = 0; i < files->size(); ++i) {
    const std::int64_t n = number_of((*files)[i]);
    if (!picture.emplace(n >= 0 ? n : static_cast<std::int64_t>(i), (*files)[i]).second)
      return make_error(ErrorCode::kInvalid, (*files)[i], "has the same frame number as another picture");
  }
  TruthByFrame truth;
  const std::string truth_path = fs::path(options.truth).is_absolute() ? options.truth : (root / options.truth).string();
  if (fs::exists(truth_path) || options.truth_required) {
    auto read = read_truth(truth_path);
    if (!read.ok()) return read.error();
    truth = std::move(*read);
    report.has_truth = true;
  }

  Vec3 middle = Vec3::Zero();
  double radius = 0;
  for (const Feature& f : model->features()) middle += f.p_m.xyz / static_cast<double>(model->features().size());
  for (const Feature& f : model->features()) radius = std::max(radius, (f.p_m.xyz - middle).norm());
  const Camera camera(*k, {});
  report.sigma_px = options.prior_sigma_px > 0 ? options.prior_sigma_px : estimate_sigma_px(*prior, camera, Point<frame::M>(middle));

  auto created = FlightWriter::create(options.out, options.replace);
  if (!created.ok()) return created.error();
  FlightWriter out = std::move(created).value();
  const World world(prior->front().t_ns);
  const Mat3 R_c_r = camera_from_receiver({}).matrix();
  const Eigen::DiagonalMatrix<double, 3> flip(-1, 1, -1);
  hil::ArrivalQueue messages;
  const auto later = [&](std::int64_t arrival, const char* channel, const auto& message) { messages.add(kServiceStart_ns + arrival, channel, message); };
  const auto mark = [&](std::int64_t t) {
    time_mark_t m{};
    m.service_time_ns = kServiceStart_ns + t;
    m.gps_time_ns = kGpsStart_ns + t;
    m.sigma_ns = 1000;
    m.source = time_mark_t::RECORDED;
    later(t, "TIME_MARK", m);
  };
  const std::int64_t begin = prior->front().t_ns - 100'000'000;
  for (std::int64_t t = begin; t < prior->back().t_ns; t += 1'000'000'000) mark(t);

  double period_s = 1 / options.rate_hz;
  if (prior->size() > 1) period_s = static_cast<double>(prior->back().t_ns - prior->front().t_ns) * 1e-9 / static_cast<double>(prior->back().frame - prior->front().frame);
  for (std::size_t i = 0; i < prior->size(); ++i) {
    const PriorPose& p = (*prior)[i];
    const auto file = picture.find(p.frame);
    if (file == picture.end()) return make_error(ErrorCode::kNotFound, options.folder + "/frames", "no picture for frame " + std::to_string(p.frame) + " of the prior");
    auto image = read_image(file->second, *k, report.from_colour);
    if (!image.ok()) return image.error();
    const bool sixteen = image->depth() == CV_16U;
    if (i == 0) report.sixteen_bit = sixteen;
    else if (sixteen != report.sixteen_bit) return make_error(ErrorCode::kInvalid, file->second, "has another number of bits than the frames before");

    const auto id = static_cast<std::int64_t>(i + 1);  // a camera counts from 1
    const std::int64_t start = p.t_ns - kExposure_ns / 2, arrival = p.t_ns + kExposure_ns / 2 + kReadout_ns;
    FlightFrame frame;
    frame.camera_frame_id = static_cast<std::uint64_t>(id);
    frame.camera_tick_ns = kCameraStart_ns + start;
    frame.exposure = Duration{kExposure_ns};
    frame.image = {image->data, image->cols, image->rows, static_cast<int>(image->step[0]), sixteen ? PixelFormat::kMono16 : PixelFormat::kMono8};
    auto number = out.frame(Time{kServiceStart_ns + arrival}, frame);
    if (!number.ok()) return number.error();

    strobe_edge_t edge{};
    edge.service_time_ns = kServiceStart_ns + start;
    edge.line_seq = id;
    edge.edge = strobe_edge_t::RISING;
    later(start, "STROBE", edge);

    // T_r_k = T_c_r^-1 T_c_m T_m_k, with p_m = flip p_k + middle.
    const double depth = (p.T_c_m * Point<frame::M>(middle)).xyz.z();
    if (!(depth > 0)) return make_error(ErrorCode::kInvalid, options.prior, "frame " + std::to_string(p.frame) + ": the model is behind the camera");
    const Mat3 R_r_k = R_c_r.transpose() * p.T_c_m.rotation().matrix() * flip;
    const Vec3 t_r_k = R_c_r.transpose() * (p.T_c_m * Point<frame::M>(middle)).xyz;
    const double lateral = report.sigma_px * depth / k->fx_px;
    const double turn = 0.5 * lateral / std::max(radius, 1e-9);
    const Vec3 here = world.position(p.t_ns);
    const int seq = static_cast<int>(i);
    hil::AircraftState receiver{here, world.velocity_e, world.R_e_r, Vec3::Zero(), Vec3::Constant(1e-6), 0.05, Vec3::Constant(1e-7)};
    hil::AircraftState tanker{here + world.R_e_r * t_r_k, world.velocity_e, world.R_e_r * R_r_k, Vec3::Zero(), {3 * lateral, lateral, lateral}, 0.05, Vec3::Constant(std::min(turn, 0.5))};
    const std::int64_t heard = p.t_ns + kTspiLatency_ns;
    later(heard, "TSPI_RECEIVER", hil::tspi_message(0, kGpsStart_ns + p.t_ns, seq, receiver));
    later(heard, "TSPI_TANKER", hil::tspi_message(1, kGpsStart_ns + p.t_ns, seq, tanker));

    frame_index_t index{};
    index.seq = id;
    index.camera_frame_id = id;
    index.mid_exposure_ns = kServiceStart_ns + p.t_ns;
    index.camera_tick_ns = frame.camera_tick_ns;
    index.arrival_ns = kServiceStart_ns + p.t_ns + kExposure_ns / 2 + 1'000'000;
    index.exposure_ns = kExposure_ns;
    index.status = frame_index_t::COMPLETE;
    index.time_source = frame_index_t::TIME_STROBE;
    index.pixel_format = static_cast<std::int8_t>(frame.image.format);
    index.width_px = static_cast<std::int16_t>(k->width);
    index.height_px = static_cast<std::int16_t>(k->height);
    index.recorded_in = "frames.lcm";
    index.recorded_at = *number;
    later(arrival, "FRAME", index);

    if (const auto it = truth.find(p.frame); it != truth.end()) {
      truth_t t{};
      t.camera_frame_id = id;
      t.mid_exposure_ns = kServiceStart_ns + p.t_ns;
      t.n = static_cast<std::int32_t>(it->second.size());
      for (const TruthPoint& point : it->second) {
        t.id.push_back(point.id);
        t.u_px.push_back(point.u);
        t.v_px.push_back(point.v);
        t.visible.push_back(static_cast<std::int8_t>(point.visible));
      }
      later(arrival, "TRUTH", t);
    }
    ++report.frames;
  }
  CYCLOPS_TRY(messages.write(out));
  CYCLOPS_TRY(out.text("tanker.csv", *features_text));
  CYCLOPS_TRY(out.text("rig.toml", rig_toml(*k, middle, radius, std::round(1e6 / period_s) * 1e-6, report.sixteen_bit)));
  FlightManifest manifest;
  manifest.name = fs::weakly_canonical(root).filename().string();
  manifest.origin = "imported";
  manifest.source = "cyclops-import, prior " + fs::path(options.prior).filename().string();
  manifest.frames = report.frames;
  manifest.first_frame_ns = kServiceStart_ns + prior->front().t_ns;
  manifest.last_frame_ns = kServiceStart_ns + prior->back().t_ns;
  manifest.nav_every_n = report.nav_every_n = nav_interval(*prior);
  manifest.has_truth = report.has_truth;
  CYCLOPS_TRY(out.finish(manifest));
  report.width = k->width;
  report.height = k->height;
  report.features = model->features().size();
  return report;
}

}  // namespace cyclops::tools
