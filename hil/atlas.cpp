#include "hil/atlas.hpp"

#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "hil/render.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kBackground_cdm2 = 4000;
constexpr int kTile_px = 220, kColumns = 8;
const cv::Scalar kSeen(90, 220, 60), kHidden(60, 60, 240), kText(40, 220, 240);

/// Camera that looks from eye to target with the model's z upwards on the picture (x aft when it looks straight up).
View view_of(const Vec3& eye, const Vec3& target) {
  const Vec3 z = (target - eye).normalized();
  const Vec3 up = std::fabs(z.z()) > 0.999 ? Vec3(1, 0, 0) : Vec3(0, 0, 1);
  const Vec3 x = z.cross(up).normalized(), y = z.cross(x);
  Mat3 R;
  R << x.transpose(), y.transpose(), z.transpose();
  View v;
  v.T_c_m = {Rotation<frame::C, frame::M>(R), Point<frame::C>(-(R * eye))};
  v.R_n_m = Eigen::DiagonalMatrix<double, 3>(-1, 1, -1);  // level, heading north
  v.R_n_c = v.R_n_m * R.transpose();
  return v;
}

/// Pictures through one lens.
class Painter {
 public:
  Painter(const Mesh& mesh, const TankerModel& model, int side_px, double focal_px) : side_(side_px), model_(model), renderer_(Camera(lens(side_px, focal_px), {}), mesh, {}, 1) {}
  /// `only`: the feature whose cross is drawn; else circles around all.
  [[nodiscard]] cv::Mat shoot(const Vec3& eye, const Vec3& target, bool marks, std::optional<std::int32_t> only = {}) const {
    const View view = view_of(eye, target);
    std::vector<std::uint16_t> counts;
    renderer_.render(view, counts);
    cv::Mat grey(side_, side_, CV_16U, counts.data()), out;
    grey.convertTo(out, CV_8U, 255.0 / 4095);
    cv::cvtColor(out, out, cv::COLOR_GRAY2BGR);
    if (!marks) return out;
    for (const FeatureTruth& t : renderer_.truth(view, model_))
      if (t.in_front && (!only || t.id == *only)) mark(out, t, only.has_value());
    return out;
  }

 private:
  static void mark(cv::Mat& out, const FeatureTruth& t, bool cross) {
    const cv::Point p(cvRound(t.raw_px.x()), cvRound(t.raw_px.y()));
    const cv::Scalar colour = t.visible ? kSeen : kHidden;
    if (cross) {
      for (const cv::Point& d : {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)}) cv::line(out, p + 8 * d, p + 24 * d, colour, 1);
    } else {
      cv::circle(out, p, 5, colour, 1, cv::LINE_AA);
      cv::putText(out, std::to_string(t.id), p + cv::Point(6, -4), cv::FONT_HERSHEY_SIMPLEX, 0.35, kText, 1, cv::LINE_AA);
    }
  }
  static Intrinsics lens(int side_px, double focal_px) {
    Intrinsics k;
    k.width = k.height = side_px;
    k.fx_px = k.fy_px = focal_px;
    k.cx_px = k.cy_px = 0.5 * (side_px - 1);
    return k;
  }
  int side_;
  const TankerModel& model_;
  Renderer renderer_;
};

Result<> save(const std::string& folder, const char* name, const cv::Mat& picture) {
  const std::string path = (std::filesystem::path(folder) / name).string();
  if (!cv::imwrite(path, picture)) return make_error(ErrorCode::kIo, path, "cannot be written");
  return Ok{};
}

cv::Mat three_view(const Mesh& mesh, const TankerModel& model) {
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (const Vec3& v : mesh.vertices_m) low = low.cwiseMin(v), high = high.cwiseMax(v);
  const Vec3 middle = 0.5 * (low + high);
  constexpr double kFar = 12;  // lengths of the aircraft
  constexpr int kSide_px = 900;
  const double far = kFar * (high - low).maxCoeff();
  const Painter painter(mesh, model, kSide_px, 0.9 * kSide_px * kFar);
  std::vector<cv::Mat> views;
  for (const Vec3& from : {Vec3(0, 0, -1), Vec3(0, -1, 0), Vec3(1, 0, 0)}) views.push_back(painter.shoot(middle + far * from, middle, true));
  views.push_back(painter.shoot(middle + far * Vec3(0.8, -0.35, -0.35).normalized(), middle, false));
  cv::Mat top, bottom, out;
  cv::hconcat(views[0], views[1], top);
  cv::hconcat(views[2], views[3], bottom);
  cv::vconcat(top, bottom, out);
  return out;
}

cv::Mat close_ups(const Mesh& mesh, const TankerModel& model, const Vec3& eye, double width_m) {
  double distance = 0;
  for (const Feature& f : model.features()) distance += (f.p_m.xyz - eye).norm() / static_cast<double>(model.features().size());
  const Painter painter(mesh, model, kTile_px, kTile_px * distance / width_m);
  const int n = static_cast<int>(model.features().size()), rows = (n + kColumns - 1) / kColumns;
  cv::Mat out(rows * kTile_px, kColumns * kTile_px, CV_8UC3, cv::Scalar::all(0));
  for (int i = 0; i < n; ++i) {
    const Feature& f = model.features()[static_cast<std::size_t>(i)];
    cv::Mat tile = painter.shoot(eye, f.p_m.xyz, true, f.id);
    cv::putText(tile, std::to_string(f.id) + " " + f.name.substr(0, 30), {4, 12}, cv::FONT_HERSHEY_SIMPLEX, 0.34, kText, 1, cv::LINE_AA);
    cv::rectangle(tile, {0, 0, kTile_px, kTile_px}, cv::Scalar::all(60));
    tile.copyTo(out(cv::Rect(i % kColumns * kTile_px, i / kColumns * kTile_px, kTile_px, kTile_px)));
  }
  return out;
}

}  // namespace

Result<> draw_atlas(const std::string& folder, const Mesh& mesh, const TankerModel& model, const AtlasOptions& o) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return make_error(ErrorCode::kIo, folder, "cannot be made: " + failed.message());
  CYCLOPS_TRY(save(folder, "three_view.png", three_view(mesh, model)));
  const double e = o.elevation_deg * kDeg, a = o.azimuth_deg * kDeg;
  const Vec3 away(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  const Vec3 eye = o.reference_m + o.range_m * away, near = o.reference_m + 0.53 * o.range_m * away;
  constexpr double kFocal_px = 1041.6667, kTilt = 16 * kDeg;
  const Vec3 ahead(-std::cos(kTilt), 0, std::sin(kTilt));
  const Painter receiver(mesh, model, 1024, kFocal_px);
  CYCLOPS_TRY(save(folder, "receiver.png", receiver.shoot(eye, eye + ahead, false)));
  CYCLOPS_TRY(save(folder, "contact.png", receiver.shoot(near, near + ahead, true)));
  return save(folder, "features.png", close_ups(mesh, model, eye, o.close_up_m));
}

}  // namespace cyclops::hil
