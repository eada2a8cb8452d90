#include "service/rig.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops {
namespace {

constexpr double kFarthest = 1e5;  // m or in
constexpr double kDeg = 3.14159265358979323846 / 180;

void read_camera(const ConfigFile& file, ConfigTable t, Rig& rig, std::string& windscreen) {
  Intrinsics k;
  t.read("address", rig.device.address);
  t.read_in("width_px", 16, kMaxImageSide, k.width);
  t.read_in("height_px", 16, kMaxImageSide, k.height);
  t.read_enum("pixel_format", {"mono8", "mono10", "mono12", "mono16"}, rig.device.format);
  t.read_in("frame_rate_hz", 0.1, 1000.0, rig.device.frame_rate_hz);
  t.read_in("exposure_us", 1.0, 1e6, rig.device.exposure_us);
  t.read_in("frozen_after", 0, 1000, rig.device.frozen_after);
  double pitch_um = k.pitch_m * 1e6, focal_mm = 0;
  t.read_in("pitch_um", 0.1, 1000.0, pitch_um);
  k.pitch_m = pitch_um * 1e-6;
  if (t.has("focal_mm")) {
    t.read_in("focal_mm", 0.1, 10000.0, focal_mm);
    k.fx_px = k.fy_px = focal_mm * 1e-3 / k.pitch_m;
    if (t.has("fx_px") || t.has("fy_px")) t.fail("focal_mm", "stands beside fx_px or fy_px, expected one of the two");
  }
  k.cx_px = 0.5 * (k.width - 1);
  k.cy_px = 0.5 * (k.height - 1);
  t.read_in("fx_px", 1.0, 1e6, k.fx_px);
  t.read_in("fy_px", 1.0, 1e6, k.fy_px);
  t.read_in("cx_px", -1e5, 1e5, k.cx_px);
  t.read_in("cy_px", -1e5, 1e5, k.cy_px);
  t.read_in("k1", -10.0, 10.0, k.k1);
  t.read_in("k2", -100.0, 100.0, k.k2);
  t.read_in("p1", -1.0, 1.0, k.p1);
  t.read_in("p2", -1.0, 1.0, k.p2);
  t.read_in("k3", -1000.0, 1000.0, k.k3);
  t.read("windscreen", windscreen);
  if (!windscreen.empty()) {
    rig.files.push_back({windscreen, file.resolve(windscreen)});
    windscreen = rig.files.back().path;
  }
  rig.device.width_px = k.width;
  rig.device.height_px = k.height;
  rig.camera = Camera(k, {});
}

void read_mount(ConfigTable t, Rig& rig) {
  double pan = 0, tilt = 0, roll = 0, sigma = 0;
  t.read_in("pan_deg", -180.0, 180.0, pan);
  t.read_in("tilt_deg", -90.0, 90.0, tilt);
  t.read_in("roll_deg", -180.0, 180.0, roll);
  t.read_in("boresight_sigma_deg", 0.0, 20.0, sigma);
  t.read_three("lens_in_receiver_m", kFarthest, rig.lens.xyz);
  rig.mount_angles = {pan * kDeg, tilt * kDeg, roll * kDeg};
  rig.boresight_sigma_rad = sigma * kDeg;
}

constexpr int kPpsLine = 18;  // where the rig does not say

StrobeConfig no_pps() {
  StrobeConfig c;
  c.kind = StrobeKind::kNone;
  c.line = kPpsLine;
  return c;
}

/// What timesync needs from the tables of the camera and the two lines.
void complete(Rig& rig) {
  FrameStamperConfig& c = rig.stamper;
  c.period = rig.device.period();
  c.edge_delay = rig.strobe.delay;
  c.delay_sigma = rig.strobe.delay_sigma;
  c.rising = rig.strobe.rising;
  rig.gps.clock.wander_per_rs = c.clock.wander_per_rs;
  rig.pps_marks.rising = rig.pps.rising;
  rig.pps_marks.delay = rig.pps.delay;
  rig.pps_marks.delay_sigma = std::max(rig.pps.delay_sigma, Duration{1});
  c.residual_max = std::min(c.residual_max, c.period / 8);
}

}  // namespace

Result<Rig> Rig::load(const std::string& path, const std::string& other_tanker, const std::string& other_looks) {
  auto file = ConfigFile::load(path);
  if (!file.ok()) return file.error();
  Rig rig;
  rig.path = path;
  ConfigTable root = file->root();
  std::string windscreen, model, looks, unit = "m";
  read_camera(*file, root.table("camera"), rig, windscreen);
  read_mount(root.table("mount"), rig);
  ConfigTable tanker = root.table("tanker");
  Vec3 ins = Vec3::Zero();
  int unit_choice = 1;
  tanker.require("model", model);
  tanker.read("looks", looks);
  tanker.read_choice("unit", {"in", "m"}, unit_choice);
  tanker.read_three("ins", kFarthest, ins);
  const double metres = rig.tanker_unit_m = unit_choice == 0 ? 0.0254 : 1.0;
  double survey_m = kSurveySigma_m;
  if (double sigma = 0; tanker.has("sigma")) {
    tanker.read_in("sigma", 0.0, 10.0 / metres, sigma);
    survey_m = sigma * metres;
  }
  ConfigTable strobe = root.table("strobe"), pps = root.table("pps"), time = root.table("time"), tspi = root.table("tspi");
  const auto take = [](auto result, auto& out) -> Result<> {
    if (!result.ok()) return result.error();
    out = *result;
    return Ok{};
  };
  CYCLOPS_TRY(take(StrobeConfig::read(strobe, {}), rig.strobe));
  CYCLOPS_TRY(take(StrobeConfig::read(pps, no_pps()), rig.pps));
  CYCLOPS_TRY(take(FrameStamperConfig::read(time), rig.stamper));
  CYCLOPS_TRY(take(GpsClockConfig::read(time), rig.gps));
  CYCLOPS_TRY(take(NavRig::read(tspi), rig.nav));
  if (rig.gps.use_pps && rig.pps.kind == StrobeKind::kNone) time.fail("gps_from", "is \"pps\", expected [pps] with source = \"gpio\" or \"socket\" beside it");
  if (rig.pps.kind != StrobeKind::kNone && rig.pps.kind == rig.strobe.kind && rig.pps.chip == rig.strobe.chip && rig.pps.line == rig.strobe.line && rig.pps.line_name == rig.strobe.line_name)
    pps.fail("line", "is that of the strobe, expected another line");
  complete(rig);
  CYCLOPS_TRY(file->finish());
  CYCLOPS_TRY(rig.stamper.validated());
  rig.files.push_back({model, other_tanker.empty() ? file->resolve(model) : other_tanker});
  auto loaded = TankerModel::load(rig.files.back().path, metres, ins, survey_m);
  if (!loaded.ok()) return loaded.error();
  rig.tanker = std::move(loaded).value();
  if (!other_looks.empty() || (!looks.empty() && other_tanker.empty())) {
    rig.files.push_back({looks, other_looks.empty() ? file->resolve(looks) : other_looks});
    auto seen = Looks::load(rig.files.back().path, rig.tanker);
    if (!seen.ok()) return seen.error();
    rig.looks = std::move(seen).value();
  }
  if (!windscreen.empty()) {
    auto screen = Windscreen::load(windscreen);
    if (!screen.ok()) return screen.error();
    rig.camera = Camera(rig.camera.intrinsics(), std::move(screen).value());
  }
  return rig;
}

}  // namespace cyclops
