#include "hil/flight_rig.hpp"

#include "hil/made_up_windscreen.hpp"
#include "hil/noise.hpp"

#include <numbers>
#include <sstream>

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

std::string vector_text(const Vec3& v) {
  std::ostringstream o;
  o.precision(17);
  o << "[" << v.x() << ", " << v.y() << ", " << v.z() << "]";
  return o.str();
}

/// Pan, tilt and roll of a mount: the inverse of camera_from_receiver.
MountAngles mount_angles(const Rotation<frame::C, frame::R>& R_c_r) {
  const HeadingPitchBank a = heading_pitch_bank(R_c_r.inverse().matrix() * camera_from_receiver({}).matrix());
  return {a.heading, a.pitch, a.bank};
}

}  // namespace

std::string rig_toml(const FlightScene& scene, const ToldRig& told) {
  const Scenario& s = scene.scenario;
  const Intrinsics& k = s.camera;
  const MountAngles mount = mount_angles(told.place.R_c_r);
  std::ostringstream o;
  o.precision(17);
  o << "# Made by cyclops-flight, scenario " << s.name << ".\n[camera]\naddress = \"127.0.0.1\"\nwidth_px = " << k.width << "\nheight_px = " << k.height
    << "\npixel_format = \"mono12\"\nframe_rate_hz = " << s.frame_rate_hz << "\nexposure_us = " << s.exposure_us << "\nfx_px = " << k.fx_px << "\nfy_px = " << k.fy_px
    << "\ncx_px = " << k.cx_px << "\ncy_px = " << k.cy_px << "\npitch_um = " << k.pitch_m * 1e6 << "\nk1 = " << k.k1 << "\nk2 = " << k.k2
    << "\np1 = " << k.p1 << "\np2 = " << k.p2 << "\nk3 = " << k.k3 << (scene.camera.windscreen().empty() ? "" : "\nwindscreen = \"windscreen.bin\"")
    << "\n[mount]\npan_deg = " << mount.pan / kDeg << "\ntilt_deg = " << mount.tilt / kDeg << "\nroll_deg = " << mount.roll / kDeg
    << "\nlens_in_receiver_m = " << vector_text(told.place.lens_in_receiver_m) << "\nboresight_sigma_deg = " << told.boresight_sigma_deg
    << "\n[tanker]\nmodel = \"tanker.csv\"\nunit = \"in\"\nins = " << vector_text(s.ins_in) << "\n[strobe]\nsource = \"socket\"\nsocket = \"@cyclops-strobe\"\nedge = \"rising\"\n"
    << "[tspi]\nreceiver_ins_m = " << vector_text(told.points.receiver_ins_from_tspi_m) << "\ntanker_ins_m = " << vector_text(told.points.tanker_ins_from_tspi_m) << "\n";
  return o.str();
}

FlightManifest flight_manifest(const FlightScene& scene, const std::string& source) {
  FlightManifest m;
  m.name = scene.scenario.name;
  m.origin = "generated";
  m.source = source;
  m.frames = scene.scenario.frames;
  m.first_frame_ns = scene.mid_ns(0);
  m.last_frame_ns = scene.mid_ns(scene.scenario.frames - 1);
  m.has_truth = true;
  return m;
}

Result<Windscreen> said_windscreen(const FlightScene& scene) {
  const Scenario& s = scene.scenario;
  if (s.windscreen_sigma_px <= 0) return scene.camera.windscreen();
  Calibration how;
  how.sigma_px = s.windscreen_sigma_px;
  how.parallax_mm = s.look.optics.windscreen_parallax_mm;
  how.focal_px = s.camera.fx_px;
  how.seed = key(static_cast<std::uint64_t>(s.navigation.seed), 0x91D);
  return calibrated_windscreen(scene.camera.windscreen(), s.camera.width, s.camera.height, how);
}

}  // namespace cyclops::hil
