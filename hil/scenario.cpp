#include "hil/scenario.hpp"

#include <cmath>

#include "base/config.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

void read_camera(ConfigTable t, Scenario& s) {
  double pitch_um = s.camera.pitch_m * 1e6, focal_mm = s.camera.fx_px * s.camera.pitch_m * 1e3;
  t.read_in("width_px", 64, 4096, s.camera.width);
  t.read_in("height_px", 64, 4096, s.camera.height);
  t.read_in("focal_mm", 1.0, 1000.0, focal_mm);
  t.read_in("pitch_um", 0.5, 100.0, pitch_um);
  t.read_in("k1", -1.0, 1.0, s.camera.k1);
  t.read_in("k2", -1.0, 1.0, s.camera.k2);
  t.read_in("p1", -0.1, 0.1, s.camera.p1);
  t.read_in("p2", -0.1, 0.1, s.camera.p2);
  t.read_in("k3", -1.0, 1.0, s.camera.k3);
  t.read_in("windscreen", 0.0, 10.0, s.windscreen);
  t.read_in("windscreen_sigma_px", 0.0, 10.0, s.windscreen_sigma_px);
  t.read_in("frame_rate_hz", 1.0, 1000.0, s.frame_rate_hz);
  t.read_in("exposure_us", 1.0, 1e6, s.exposure_us);
  t.read_in("readout_ms", 0.1, 1000.0, s.readout_ms);
  t.read_in("tick_drift_ppm", -1000.0, 1000.0, s.tick_drift_ppm);
  s.camera.pitch_m = pitch_um * 1e-6;
  s.camera.fx_px = s.camera.fy_px = focal_mm * 1e-3 / s.camera.pitch_m;
  s.camera.cx_px = 0.5 * (s.camera.width - 1);
  s.camera.cy_px = 0.5 * (s.camera.height - 1);
}

void read_mount(ConfigTable t, Scenario& s) {
  double pan = s.mount.pan / kDeg, tilt = s.mount.tilt / kDeg, roll = s.mount.roll / kDeg;
  t.read_in("pan_deg", -180.0, 180.0, pan);
  t.read_in("tilt_deg", -90.0, 90.0, tilt);
  t.read_in("roll_deg", -180.0, 180.0, roll);
  t.read_three("lens_in_receiver_m", 1e6, s.lens_in_receiver_m);
  t.read_three("nose_from_lens_m", 1e6, s.nose_from_lens_m);
  s.mount = {pan * kDeg, tilt * kDeg, roll * kDeg};
}

void read_place(ConfigTable t, Scenario& s) {
  t.read_in("latitude_deg", -80.0, 80.0, s.latitude_deg);
  t.read_in("longitude_deg", -180.0, 180.0, s.longitude_deg);
  t.read_in("height_m", 0.0, 20000.0, s.height_m);
  t.read_in("speed_mps", 30.0, 400.0, s.speed_mps);
  t.read_in("heading_deg", -360.0, 360.0, s.heading_deg);
  t.read_in("wind_north_mps", -60.0, 60.0, s.wind_north_mps);
  t.read_in("wind_east_mps", -60.0, 60.0, s.wind_east_mps);
  t.read_in("tanker_alpha_deg", -10.0, 20.0, s.tanker_alpha_deg);
  t.read_in("receiver_alpha_deg", -10.0, 20.0, s.receiver_alpha_deg);
}

void read_where(ConfigTable& t, double& range_ft, double& azimuth_deg, double& elevation_deg) {
  t.read_in("range_ft", 5.0, 20000.0, range_ft);
  t.read_in("azimuth_deg", -80.0, 80.0, azimuth_deg);
  t.read_in("elevation_deg", -80.0, 80.0, elevation_deg);
}

/// A leg begins where the one before it was meant to end, so a place may leave out what does not change.
void read_legs(ConfigTable& root, Scenario& s) {
  if (!root.has("leg")) return;
  s.legs.clear();
  Leg last;
  last.range_ft = s.range_ft, last.azimuth_deg = s.azimuth_deg, last.elevation_deg = s.elevation_deg;
  for (ConfigTable& t : root.tables("leg")) {
    Leg leg;
    leg.for_s = 1;
    int for_frames = 1;
    t.read("name", leg.name);
    t.read_in("for_s", 0.1, 3600.0, leg.for_s);
    t.read_in("for_frames", 1, 100000, for_frames);
    if (t.has("for_s") == t.has("for_frames")) t.fail("for_s", "expected one of for_s and for_frames");
    if (t.has("for_frames")) leg.for_s = for_frames / s.frame_rate_hz;
    t.read_in("closing_ftps", -100.0, 100.0, leg.closing_ftps);
    t.read_in("right_ftps", -100.0, 100.0, leg.right_ftps);
    t.read_in("up_ftps", -100.0, 100.0, leg.up_ftps);
    leg.to_place = t.has("range_ft") || t.has("azimuth_deg") || t.has("elevation_deg");
    if (leg.to_place && (t.has("closing_ftps") || t.has("right_ftps") || t.has("up_ftps"))) t.fail("range_ft", "a leg has rates or a place, not both");
    t.read_in("gusts", 0.0, 20.0, leg.gusts);
    leg.range_ft = last.range_ft, leg.azimuth_deg = last.azimuth_deg, leg.elevation_deg = last.elevation_deg;
    read_where(t, leg.range_ft, leg.azimuth_deg, leg.elevation_deg);
    if (leg.to_place) last = leg;
    s.legs.push_back(leg);
  }
}

void read_manoeuvres(ConfigTable& root, Scenario& s) {
  if (root.has("turn")) {
    s.turns.clear();
    for (ConfigTable& t : root.tables("turn")) {
      Turn turn;
      t.read_in("at_s", -1000.0, 10000.0, turn.at_s);
      t.read_in("bank_deg", -60.0, 60.0, turn.bank_deg);
      t.read_in("over_s", 0.5, 1000.0, turn.over_s);
      s.turns.push_back(turn);
    }
  }
  if (!root.has("wing_rock")) return;
  s.wing_rocks.clear();
  for (ConfigTable& t : root.tables("wing_rock")) {
    WingRock rock;
    t.read_enum("aircraft", {"receiver", "tanker"}, rock.tanker);
    t.read_in("at_s", 0.0, 10000.0, rock.at_s);
    t.read_in("bank_deg", 0.0, 45.0, rock.bank_deg);
    t.read_in("period_s", 1.0, 30.0, rock.period_s);
    t.read_in("cycles", 1, 20, rock.cycles);
    s.wing_rocks.push_back(rock);
  }
}

/// Three numbers: sigma in the unit of the name, frequency of the mode in Hz, its damping.
void read_shape(ConfigTable& t, const char* name, WanderShape& out) {
  Vec3 v(out.sigma, out.frequency_hz, out.damping);
  t.read_three(name, 1e6, v);
  if (v[0] < 0 || v[0] > 20 || v[1] < 0.005 || v[1] > 2 || v[2] < 0.05 || v[2] > 3) t.fail(name, "expected [sigma 0..20, frequency 0.005..2 Hz, damping 0.05..3]");
  else out = {v[0], v[1], v[2]};
}

void read_gusts(ConfigTable t, Gusts& g) {
  read_shape(t, "along_m", g.along_m);
  read_shape(t, "right_m", g.right_m);
  read_shape(t, "down_m", g.down_m);
  read_shape(t, "bank_deg", g.bank_deg);
  read_shape(t, "pitch_deg", g.pitch_deg);
  read_shape(t, "yaw_deg", g.yaw_deg);
}

void read_errors(ConfigTable& t, Navigation& n) {
  t.read_in("position_sigma_m", 0.0, 100.0, n.position_sigma_m);
  t.read_in("position_tau_s", 0.1, 1e5, n.position_tau_s);
  t.read_in("shared_position_sigma_m", 0.0, 100.0, n.shared_position_sigma_m);
  t.read_in("attitude_sigma_deg", 0.0, 10.0, n.attitude_sigma_deg);
  t.read_in("attitude_tau_s", 0.1, 1e5, n.attitude_tau_s);
  t.read_in("velocity_sigma_mps", 0.0, 10.0, n.velocity_sigma_mps);
  t.read_in("rate_sigma_dps", 0.0, 10.0, n.rate_sigma_dps);
  t.read_in("boresight_sigma_deg", 0.0, 5.0, n.boresight_sigma_deg);
  t.read_in("lever_arm_sigma_m", 0.0, 5.0, n.lever_arm_sigma_m);
  t.read_enum("reduction", {"body", "flight-path"}, n.reduction);
  t.read_in("stated_sigma_factor", 0.01, 100.0, n.stated_sigma_factor);
  t.read("stated_sigma_follows", n.stated_sigma_follows);
  t.read_in("error_spread", 0.0, 1.0, n.error_spread);
  t.read("error_at_s", n.error_at_s);
  t.read("error_px", n.error_px);
  if (n.error_at_s.size() != n.error_px.size()) t.fail("error_px", "expected as many numbers as error_at_s has");
  for (std::size_t i = 0; i < n.error_px.size(); ++i)
    if (!(n.error_px[i] >= 0 && n.error_px[i] <= 500) || (i > 0 && i < n.error_at_s.size() && n.error_at_s[i] <= n.error_at_s[i - 1]))
      return t.fail("error_px", "expected 0 to 500 px at times that grow");
}

void read_navigation(ConfigTable t, Navigation& n) {
  t.read_enum("is", {"measured", "true"}, n.is_true);
  t.read("seed", n.seed);
  t.read_in("rate_hz", 1.0, 1000.0, n.rate_hz);
  read_errors(t, n);
  t.read_in("latency_ms", 0.0, 1000.0, n.latency_ms);
  t.read_in("latency_jitter_ms", 0.0, n.latency_ms, n.latency_jitter_ms);
  t.read_in("link_latency_ms", 0.0, 1000.0, n.link_latency_ms);
  t.read_in("dropouts_per_minute", 0.0, 600.0, n.dropouts_per_minute);
  t.read_in("dropout_s", 0.02, 60.0, n.dropout_s);
  t.read_in("duplicate_share", 0.0, 1.0, n.duplicate_share);
  t.read_in("swapped_share", 0.0, 0.5, n.swapped_share);
  t.read_three("receiver_point_m", 1e6, n.receiver_point_m);
  t.read_three("tanker_point_m", 1e6, n.tanker_point_m);
}

constexpr int kDeepest = 4;  // bases of bases

Result<> read(const ConfigFile& file, Scenario& s, int depth) {
  ConfigTable root = file.root();
  std::string base;
  root.read("base", base);
  if (!base.empty()) {
    if (depth == kDeepest) return make_error(ErrorCode::kInvalid, root.where("base"), "more than " + std::to_string(kDeepest) + " files stand on each other");
    auto below = ConfigFile::load(file.resolve(base));
    if (!below.ok()) return make_error(below.error().code, root.where("base"), below.error().message());
    CYCLOPS_TRY(read(*below, s, depth + 1));
  }
  root.read("name", s.name);
  root.read("about", s.about);
  root.read_in("frames", 1, 100000, s.frames);
  root.read("seed", s.seed);
  read_camera(root.table("camera"), s);
  read_mount(root.table("mount"), s);
  ConfigTable tanker = root.table("tanker");
  std::string model;
  tanker.read("model", model);
  if (!model.empty()) s.tanker = file.resolve(model);
  s.mesh.read(tanker, file);
  tanker.read_three("ins", 1e6, s.ins_in);
  tanker.read_three("reference", 1e6, s.reference_in);
  read_place(root.table("place"), s);
  ConfigTable start = root.table("start");
  read_where(start, s.range_ft, s.azimuth_deg, s.elevation_deg);
  root.read_in("blend_s", 0.2, 20.0, s.blend_s);
  read_legs(root, s);
  read_manoeuvres(root, s);
  ConfigTable gusts = root.table("gusts");
  read_gusts(gusts.table("receiver"), s.receiver_gusts);
  read_gusts(gusts.table("tanker"), s.tanker_gusts);
  read_navigation(root.table("navigation"), s.navigation);
  read_look(root, s.look);
  s.look.sensor.exposure_us = s.exposure_us;
  if (depth == 0 && s.tanker.empty()) tanker.fail("model", "is missing");
  return file.finish();
}

Result<Scenario> read(const ConfigFile& file) {
  Scenario s;
  CYCLOPS_TRY(read(file, s, 0));
  return s;
}

}  // namespace

Result<Scenario> Scenario::load(const std::string& path) {
  auto file = ConfigFile::load(path);
  if (!file.ok()) return file.error();
  return read(*file);
}

Result<Scenario> Scenario::parse(const std::string& text, const std::string& name) {
  auto file = ConfigFile::parse(text, name);
  if (!file.ok()) return file.error();
  return read(*file);
}

}  // namespace cyclops::hil
