#include "hil/scenario.hpp"

#include <cmath>

#include "base/config.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

void read_camera(ConfigTable t, Scenario& s) {
  double focal_mm = 12.5, pitch_um = 12;
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
  double pan = 0, tilt = 16, roll = 0;
  t.read_in("pan_deg", -180.0, 180.0, pan);
  t.read_in("tilt_deg", -90.0, 90.0, tilt);
  t.read_in("roll_deg", -180.0, 180.0, roll);
  t.read_three("lens_in_receiver_m", 1e6, s.lens_in_receiver_m);
  t.read_three("nose_from_lens_m", 1e6, s.nose_from_lens_m);
  t.read_in("boresight_error_deg", 0.0, 5.0, s.boresight_error_deg);
  s.mount = {pan * kDeg, tilt * kDeg, roll * kDeg};
}

void read_approach(ConfigTable t, Scenario& s) {
  t.read_in("range_ft", 15.0, 5000.0, s.range_ft);
  t.read_in("closing_ftps", -100.0, 100.0, s.closing_ftps);
  t.read_in("elevation_deg", -80.0, 80.0, s.elevation_deg);
  t.read_in("azimuth_deg", -80.0, 80.0, s.azimuth_deg);
  t.read_in("latitude_deg", -80.0, 80.0, s.latitude_deg);
  t.read_in("longitude_deg", -180.0, 180.0, s.longitude_deg);
  t.read_in("height_m", 0.0, 20000.0, s.height_m);
  t.read_in("speed_mps", 0.0, 400.0, s.speed_mps);
  t.read_in("heading_deg", -360.0, 360.0, s.heading_deg);
  t.read_in("wander_position_m", 0.0, 5.0, s.wander_position_m);
  t.read_in("wander_attitude_deg", 0.0, 5.0, s.wander_attitude_deg);
  t.read_in("wander_period_s", 0.5, 1000.0, s.wander_period_s);
}

void read_tspi(ConfigTable t, Scenario& s) {
  t.read_in("rate_hz", 1.0, 1000.0, s.tspi_rate_hz);
  t.read_in("latency_ms", 0.0, 1000.0, s.tspi_latency_ms);
  t.read_in("latency_jitter_ms", 0.0, s.tspi_latency_ms, s.tspi_latency_jitter_ms);
  t.read_in("tau_s", 0.01, 1e6, s.tspi_tau_s);
  t.read_in("position_sigma_m", 0.0, 100.0, s.position_sigma_m);
  t.read_in("attitude_sigma_deg", 0.0, 10.0, s.attitude_sigma_deg);
  t.read_in("velocity_sigma_mps", 0.0, 10.0, s.velocity_sigma_mps);
  t.read_in("rate_sigma_dps", 0.0, 10.0, s.rate_sigma_dps);
  t.read_in("projection_error_px", 0.0, 100.0, s.projection_error_px);
}

void read_light(ConfigTable t, Scenario& s) {
  t.read_in("sun_azimuth_deg", -360.0, 360.0, s.sun_azimuth_deg);
  t.read_in("sun_elevation_deg", -10.0, 90.0, s.sun_elevation_deg);
  t.read_in("sun", 0.0, 20000.0, s.look.light.sun);
  t.read_in("sky", 0.0, 20000.0, s.look.light.sky);
  t.read_in("ground", 0.0, 20000.0, s.look.light.ground);
  t.read_in("zenith", 0.0, 4000.0, s.look.zenith);
  t.read_in("horizon", 0.0, 4000.0, s.look.horizon);
  t.read_in("cloud", 0.0, 4000.0, s.look.cloud);
  t.read_in("blur_sigma_px", 0.0, 2.0, s.look.blur_sigma_px);
  t.read_in("read_noise_e", 0.0, 1000.0, s.look.read_noise_e);
  const double a = s.sun_azimuth_deg * kDeg, e = s.sun_elevation_deg * kDeg;
  s.look.light.to_sun_n = {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), -std::sin(e)};
}

Result<Scenario> read(const ConfigFile& file) {
  Scenario s;
  ConfigTable root = file.root();
  root.require("name", s.name);
  root.read_in("frames", 1, 100000, s.frames);
  root.read("seed", s.seed);
  read_camera(root.table("camera"), s);
  read_mount(root.table("mount"), s);
  ConfigTable tanker = root.table("tanker");
  tanker.require("model", s.tanker);
  tanker.read_three("ins", 1e6, s.ins_in);
  tanker.read_three("reference", 1e6, s.reference_in);
  read_approach(root.table("approach"), s);
  read_tspi(root.table("tspi"), s);
  read_light(root.table("light"), s);
  CYCLOPS_TRY(file.finish());
  s.tanker = file.resolve(s.tanker);
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
