#include "tools/learn_views.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <unistd.h>

#include "detect/corner_detector.hpp"
#include "tools/offline.hpp"

namespace cyclops::tools::learn {
namespace {

constexpr double kLeastContrast = 2.0;  // counts, rms of a patch

bool same_survey(const TankerModel& a, const TankerModel& b) {
  const auto same = [](const Feature& x, const Feature& y) { return x.id == y.id && x.p_m.xyz == y.p_m.xyz; };
  return a.ins().xyz == b.ins().xyz && std::equal(a.features().begin(), a.features().end(), b.features().begin(), b.features().end(), same);
}

/// Bounding box of the features in the image, with the margin; empty when none is there.
SubImageSet area_of(const PredictionSet& aligned, const Camera& camera, const ViewsConfig& config) {
  Vec2 low(1e9, 1e9), high(-1e9, -1e9);
  for (const Prediction& p : aligned.items) {
    if (p.visibility == Visibility::kBehindCamera || p.visibility == Visibility::kDisabled || !camera.inside(p.uv_px)) continue;
    low = low.cwiseMin(p.uv_px);
    high = high.cwiseMax(p.uv_px);
  }
  SubImageSet out;
  if (!(low.x() < high.x())) return out;
  const double margin = std::max(config.margin_least_px, config.margin * (high - low).maxCoeff());
  SubImage box;
  box.u0 = std::max(0, static_cast<int>(low.x() - margin));
  box.v0 = std::max(0, static_cast<int>(low.y() - margin));
  box.width = std::min(camera.intrinsics().width, static_cast<int>(high.x() + margin)) - box.u0;
  box.height = std::min(camera.intrinsics().height, static_cast<int>(high.y() + margin)) - box.v0;
  out.push_back(box);
  return out;
}

Picture part_of(const ImageView& image, const SubImage& box) {
  Picture out{box.u0, box.v0, box.width, box.height, image.format, {}};
  const int side = bytes_per_pixel(image.format);
  out.pixels.resize(static_cast<std::size_t>(box.width) * box.height * side);
  for (int v = 0; v < box.height; ++v)
    std::memcpy(&out.pixels[static_cast<std::size_t>(v) * box.width * side], image.row8(box.v0 + v) + static_cast<std::ptrdiff_t>(box.u0) * side, static_cast<std::size_t>(box.width) * side);
  return out;
}

/// Takes every n-th frame of a stretch that has a pose.
class Taker {
 public:
  Taker(const Profile& profile, const ViewsConfig& config, const Stretch& stretch, const FlightManifest& manifest, int flight, Views& out)
      : profile_(profile), config_(config), stretch_(stretch), first_ns_(manifest.first_frame_ns), flight_(flight), out_(out) {
    const double flight_s = static_cast<double>(manifest.last_frame_ns - manifest.first_frame_ns) * 1e-9;
    const double length_s = std::min(stretch.to_s, flight_s) - stretch.from_s;
    apart_s_ = std::max(0.0, length_s / config.most_views);
    next_s_ = stretch.from_s;
    profile_.detect.max_corners = profile_.detect.max_corners_per_box = config.most_corners;
  }

  void see(const Rig& rig, const FrameOutput& frame, const ImageView& image) {
    const double t_s = static_cast<double>(frame.in.frame.t_mid.ns - first_ns_) * 1e-9;
    if (t_s < next_s_ || t_s > stretch_.to_s || image.data == nullptr || !frame.alignment.consensus || frame.in.frame.status != FrameStatus::kComplete) return;
    next_s_ = std::max(next_s_ + apart_s_, t_s + 0.5 * apart_s_);
    if (!detector_) {
      detector_ = std::make_unique<CornerDetector>(profile_.detect, image.width, image.height);
      corners_ = std::make_unique<CornerSet>();
    }
    const SubImageSet area = area_of(frame.aligned, rig.camera, config_);
    detector_->detect(image, nullptr, area, *corners_);
    View view{flight_, t_s, out_.cameras.back().get(), frame.alignment.T_c_k, frame.alignment.covariance, {}};
    if (config_.pictures && !area.empty()) {
      view.picture = part_of(image, area[0]);
      view.visible.resize(rig.tanker.features().size());
      for (const Prediction& p : frame.aligned.items) view.visible[p.feature] = p.visibility == Visibility::kVisible;
    }
    for (const Corner& c : corners_->items) {
      SeenCorner seen{c.uv_px, c.cov_px2, {}};
      if (c.subpixel && take_patch(image, c.uv_px, seen.patch)) view.corners.push_back(seen);
    }
    out_.views.push_back(std::move(view));
  }

 private:
  Profile profile_;
  const ViewsConfig& config_;
  const Stretch& stretch_;
  std::int64_t first_ns_;
  int flight_;
  Views& out_;
  double apart_s_{0}, next_s_{0};
  std::unique_ptr<CornerDetector> detector_;
  std::unique_ptr<CornerSet> corners_;
};

Result<> add_flight(const Stretch& stretch, const Profile& profile, const ViewsConfig& config, Views& out) {
  auto flight = FlightReader::open(stretch.folder);
  if (!flight.ok()) return flight.error();
  auto rig = Rig::load(flight->path("rig.toml"));
  if (!rig.ok()) return rig.error();
  if (out.flights.empty()) {
    out.tanker = rig->tanker;
    out.metres_per_unit = rig->tanker_unit_m;
  } else if (!same_survey(out.tanker, rig->tanker)) {
    return make_error(ErrorCode::kInvalid, stretch.folder + "/rig.toml", "tanker is another one than in " + out.flights.front() + ", expected the same features at the same places");
  }
  out.flights.push_back(stretch.folder);
  out.cameras.push_back(std::make_unique<Camera>(rig->camera));
  Taker taker(profile, config, stretch, flight->manifest(), static_cast<int>(out.flights.size()) - 1, out);
  const std::string log = (std::filesystem::temp_directory_path() / ("cyclops-learn-" + std::to_string(getpid()) + ".lcm")).string();
  const auto run = run_offline(stretch.folder, profile, log, {}, [&](const Rig& r, const FrameOutput& f, const ImageView& i) { taker.see(r, f, i); }, {.most_frames = stretch.frames(flight->manifest())});
  std::error_code ignored;
  std::filesystem::remove(log, ignored);
  if (!run.ok()) return run.error();
  return Ok{};
}

}  // namespace

Result<Stretch> Stretch::parse(const std::string& text) {
  Stretch s;
  const auto at = text.rfind('@');
  s.folder = text.substr(0, at);
  if (at == std::string::npos) return s;
  const std::string range = text.substr(at + 1);
  const char* const end = range.data() + range.size();
  const auto from = std::from_chars(range.data(), end, s.from_s);
  const bool dash = from.ec == std::errc{} && from.ptr != end && *from.ptr == '-';
  const auto to = dash ? std::from_chars(from.ptr + 1, end, s.to_s) : std::from_chars_result{from.ptr, std::errc::invalid_argument};
  if (to.ec != std::errc{} || to.ptr != end || !(s.from_s >= 0 && s.from_s < s.to_s))
    return make_error(ErrorCode::kInvalid, text, "stretch is \"" + range + "\", expected FROM-TO in seconds, as 0-20");
  return s;
}

std::int64_t Stretch::frames(const FlightManifest& manifest) const {
  const double flight_s = static_cast<double>(manifest.last_frame_ns - manifest.first_frame_ns) * 1e-9;
  return to_s < flight_s ? static_cast<std::int64_t>(to_s / flight_s * static_cast<double>(manifest.frames)) + 2 : manifest.frames;
}

bool take_patch(const ImageView& image, const Vec2& uv_px, Patch& out) {
  const int u0 = static_cast<int>(std::lround(uv_px.x())) - kPatchHalf, v0 = static_cast<int>(std::lround(uv_px.y())) - kPatchHalf;
  if (u0 < 0 || v0 < 0 || u0 + kPatchSide > image.width || v0 + kPatchSide > image.height) return false;
  const bool wide = bytes_per_pixel(image.format) == 2;
  float sum = 0, sum2 = 0;
  for (int v = 0; v < kPatchSide; ++v)
    for (int u = 0; u < kPatchSide; ++u) {
      const float x = wide ? image.row16(v0 + v)[u0 + u] : image.row8(v0 + v)[u0 + u];
      out[static_cast<std::size_t>(v * kPatchSide + u)] = x;
      sum += x;
    }
  const float mean = sum / static_cast<float>(out.size());
  for (float& x : out) {
    x -= mean;
    sum2 += x * x;
  }
  if (!(sum2 > kLeastContrast * kLeastContrast * static_cast<double>(out.size()))) return false;
  for (float& x : out) x /= std::sqrt(sum2);
  return true;
}

Result<Views> views_of(const std::vector<Stretch>& flights, const Profile& profile, const ViewsConfig& config,
                       const std::function<void(const std::string&)>& said) {
  if (!profile.align.enabled) return make_error(ErrorCode::kInvalid, "align.enabled", "is false, expected a profile that aligns: learning starts from aligned poses");
  Views out;
  for (const Stretch& s : flights) {
    if (said) said(s.folder);
    const std::size_t before = out.views.size();
    CYCLOPS_TRY(add_flight(s, profile, config, out));
    if (out.views.size() == before) return make_error(ErrorCode::kInvalid, s.folder, "has no frame whose features agreed on a pose, expected some between " + std::to_string(s.from_s) + " and " + std::to_string(s.to_s) + " s");
  }
  return out;
}

}  // namespace cyclops::tools::learn
