#include "tools/import_readers.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "base/file.hpp"
#include "msg/limits.hpp"
#include "tools/csv.hpp"

namespace cyclops::tools {
namespace fs = std::filesystem;
namespace {

constexpr double kMaxTimestamp_s = 2.5e9;                // seconds since 1970 until 2049
constexpr std::int64_t kLongest_ns = 3'600'000'000'000;  // the receiver flies straight on while the earth curves away

/// Throws nlohmann's exception where a key is missing or of another type.
Result<Intrinsics> intrinsics_from(const nlohmann::json& j, const std::string& path) {
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
}

using PoseColumns = std::array<std::string, 7>;  // names of x y z qw qx qy qz

Result<PoseColumns> pose_columns(const Csv& csv) {
  CYCLOPS_TRY(csv.one_of({"frame"}));
  const std::array<std::vector<std::string>, 7> wanted{{{"x_m", "x"}, {"y_m", "y"}, {"z_m", "z"}, {"qw"}, {"qx"}, {"qy"}, {"qz"}}};
  PoseColumns out;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    auto name = csv.one_of(wanted[i]);
    if (!name.ok()) return name.error();
    out[i] = *name;
  }
  return out;
}

/// Frame number and pose of a row, without its time.
Result<PriorPose> read_pose(const Csv& csv, std::size_t row, const PoseColumns& columns) {
  PriorPose p;
  auto frame = csv.whole(row, "frame");
  if (!frame.ok()) return frame.error();
  p.frame = *frame;
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    auto x = csv.number(row, columns[i]);
    if (!x.ok()) return x.error();
    v[i] = *x;
  }
  const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
  if (std::fabs(q.norm() - 1) > 0.01) return make_error(ErrorCode::kCorrupt, csv.where(row), "quaternion has length " + std::to_string(q.norm()) + ", expected 1");
  p.T_c_m = Pose<frame::C, frame::M>(Rotation<frame::C, frame::M>(q), Point<frame::C>(v[0], v[1], v[2]));
  return p;
}

Result<double> read_timestamp_s(const Csv& csv, std::size_t row, std::int64_t frame, double rate_hz) {
  double t_s = static_cast<double>(frame) / rate_hz;
  if (csv.has("timestamp_s")) {
    auto t = csv.number(row, "timestamp_s");
    if (!t.ok()) return t.error();
    t_s = *t;
  }
  if (std::fabs(t_s) > kMaxTimestamp_s) return make_error(ErrorCode::kCorrupt, csv.where(row), "timestamp_s is " + std::to_string(t_s) + ", expected at most " + std::to_string(kMaxTimestamp_s) + " from 0");
  return t_s;
}

/// Does `p` follow the poses before it? `t_s`: its time as the file has it.
Result<> check_follows(const std::vector<PriorPose>& before, const PriorPose& p, double t_s, const std::string& where) {
  if (before.empty()) return Ok{};
  const PriorPose& last = before.back();
  if (p.t_ns - before.front().t_ns > kLongest_ns) return make_error(ErrorCode::kUnsupported, where, "more than an hour after the first pose");
  if (p.t_ns <= last.t_ns) return make_error(ErrorCode::kCorrupt, where, "time does not go on: " + std::to_string(t_s) + " s after " + std::to_string(static_cast<double>(last.t_ns) * 1e-9) + " s");
  if (p.frame <= last.frame) return make_error(ErrorCode::kCorrupt, where, "frame " + std::to_string(p.frame) + " after frame " + std::to_string(last.frame));
  return Ok{};
}

/// `u`, `v`: names of the columns.
Result<TruthPoint> read_truth_point(const Csv& csv, std::size_t row, const std::string& u, const std::string& v) {
  auto id = csv.whole(row, "id");
  auto u_px = csv.number(row, u), v_px = csv.number(row, v);
  if (!id.ok()) return id.error();
  if (!u_px.ok()) return u_px.error();
  if (!v_px.ok()) return v_px.error();
  std::int64_t visible = 1;
  if (csv.has("visible")) {
    auto cell = csv.whole(row, "visible");
    if (!cell.ok()) return cell.error();
    visible = *cell;
  }
  if (visible < 0 || visible > 2) return make_error(ErrorCode::kCorrupt, csv.where(row), "visible is " + std::to_string(visible) + ", expected 0, 1 or 2");
  if (*id < INT32_MIN || *id > INT32_MAX) return make_error(ErrorCode::kCorrupt, csv.where(row), "id is " + std::to_string(*id) + ", expected a 32-bit number");
  return TruthPoint{static_cast<std::int32_t>(*id), *u_px, *v_px, static_cast<int>(visible)};
}

Result<std::vector<std::string>> list_files(const std::string& folder) {
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

/// An absolute name stays as it is.
std::string in_folder(const ImportOptions& options, const std::string& name) { return (fs::path(options.folder) / name).string(); }

Result<std::optional<TruthByFrame>> read_truth_if_any(const ImportOptions& options) {
  const std::string path = in_folder(options, options.truth);
  if (!fs::exists(path) && !options.truth_required) return std::optional<TruthByFrame>{};
  auto truth = read_truth(path);
  if (!truth.ok()) return truth.error();
  return std::optional<TruthByFrame>{std::move(*truth)};
}

}  // namespace

Result<Folder> read_folder(const ImportOptions& options) {
  auto k = read_camera(in_folder(options, "camera.json"));
  if (!k.ok()) return k.error();
  const std::string features_path = in_folder(options, "features.csv");
  auto features_csv = read_file(features_path);
  if (!features_csv.ok()) return features_csv.error();
  auto model = TankerModel::parse(*features_csv, features_path, 1.0, Vec3::Zero());
  if (!model.ok()) return model.error();
  std::error_code unreadable;
  auto prior = read_prior(fs::exists(options.prior, unreadable) ? options.prior : in_folder(options, options.prior), options.rate_hz);
  if (!prior.ok()) return prior.error();
  auto pictures = list_pictures(options.folder);
  if (!pictures.ok()) return pictures.error();
  auto truth = read_truth_if_any(options);
  if (!truth.ok()) return truth.error();
  return Folder{*k, std::move(*features_csv), std::move(*model), std::move(*prior), std::move(*pictures), std::move(*truth)};
}

Result<Intrinsics> read_camera(const std::string& path) {
  std::ifstream in(path);
  if (!in) return make_error(ErrorCode::kNotFound, path, "cannot be opened");
  try {
    nlohmann::json j;
    in >> j;
    return intrinsics_from(j, path);
  } catch (const nlohmann::json::exception& e) {
    return make_error(ErrorCode::kCorrupt, path, e.what());
  }
}

Result<std::vector<PriorPose>> read_prior(const std::string& path, double rate_hz) {
  auto csv = Csv::load(path);
  if (!csv.ok()) return csv.error();
  auto columns = pose_columns(*csv);
  if (!columns.ok()) return columns.error();
  std::vector<PriorPose> out;
  for (std::size_t row = 0; row < csv->rows(); ++row) {
    auto p = read_pose(*csv, row, *columns);
    if (!p.ok()) return p.error();
    auto t_s = read_timestamp_s(*csv, row, p->frame, rate_hz);
    if (!t_s.ok()) return t_s.error();
    p->t_ns = static_cast<std::int64_t>(std::llround(*t_s * 1e9));
    CYCLOPS_TRY(check_follows(out, *p, *t_s, csv->where(row)));
    if (csv->has("nav_update")) {
      auto flag = csv->whole(row, "nav_update");
      if (!flag.ok()) return flag.error();
      p->nav_update = *flag != 0;
    }
    out.push_back(*p);
  }
  if (out.empty()) return make_error(ErrorCode::kTruncated, path, "holds no pose");
  return out;
}

Result<TruthByFrame> read_truth(const std::string& path) {
  auto csv = Csv::load(path);
  if (!csv.ok()) return csv.error();
  auto u = csv->one_of({"u_px", "u"}), v = csv->one_of({"v_px", "v"});
  if (!u.ok()) return u.error();
  if (!v.ok()) return v.error();
  for (const char* need : {"frame", "id"}) CYCLOPS_TRY(csv->one_of({need}));
  TruthByFrame out;
  for (std::size_t row = 0; row < csv->rows(); ++row) {
    auto frame = csv->whole(row, "frame");
    if (!frame.ok()) return frame.error();
    auto point = read_truth_point(*csv, row, *u, *v);
    if (!point.ok()) return point.error();
    out[*frame].push_back(*point);
  }
  return out;
}

Result<PictureByFrame> list_pictures(const std::string& folder) {
  auto files = list_files(folder);
  if (!files.ok()) return files.error();
  PictureByFrame out;
  for (std::size_t i = 0; i < files->size(); ++i) {
    const std::string& file = (*files)[i];
    const std::int64_t n = number_of(file);
    if (!out.emplace(n >= 0 ? n : static_cast<std::int64_t>(i), file).second) return make_error(ErrorCode::kInvalid, file, "has the same frame number as another picture");
  }
  return out;
}

Result<GreyPicture> read_picture(const std::string& path, const Intrinsics& k) {
  cv::Mat image;
  try {
    image = cv::imread(path, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {  // a header that speaks of more pixels than OpenCV allows
  }
  if (image.empty()) return make_error(ErrorCode::kCorrupt, path, "is no picture that can be read");
  const bool colour = image.channels() != 1;
  if (colour) {
    cv::Mat grey;
    cv::cvtColor(image, grey, image.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
    image = grey;
  }
  if (image.depth() != CV_8U && image.depth() != CV_16U) return make_error(ErrorCode::kUnsupported, path, "has neither 8 nor 16 bits a sample");
  if (image.cols != k.width || image.rows != k.height)
    return make_error(ErrorCode::kInvalid, path, "is " + std::to_string(image.cols) + " x " + std::to_string(image.rows) + " px, expected " + std::to_string(k.width) + " x " + std::to_string(k.height) + " by camera.json");
  return GreyPicture{image, colour};
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

}  // namespace cyclops::tools
