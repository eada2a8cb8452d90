#include "hil/look.hpp"

#include <cmath>
#include <numbers>

namespace cyclops::hil {

Vec3 LightLook::to_sun_n() const {
  const double a = sun_azimuth_deg * std::numbers::pi / 180, e = sun_elevation_deg * std::numbers::pi / 180;
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), -std::sin(e)};
}

void read_look(ConfigTable& root, Look& look) {
  ConfigTable light = root.table("light");
  light.read_in("sun_azimuth_deg", -360.0, 360.0, look.light.sun_azimuth_deg);
  light.read_in("sun_elevation_deg", -90.0, 90.0, look.light.sun_elevation_deg);
  ConfigTable sky = root.table("sky");
  sky.read_in("cloud_cover", 0.0, 1.0, look.sky.cloud_cover);
  sky.read_in("cloud_contrast", 0.0, 2.0, look.sky.cloud_contrast);
  sky.read_in("ground_albedo", 0.0, 1.0, look.sky.ground_albedo);
  sky.read_in("ground_contrast", 0.0, 1.0, look.sky.ground_contrast);
  sky.read_in("haze_deg", 0.1, 20.0, look.sky.haze_deg);
  ConfigTable optics = root.table("optics");
  optics.read("automatic_f_number", look.optics.automatic_f_number);
  optics.read_in("f_number", 0.7, 32.0, look.optics.f_number);
  optics.read_in("blur_sigma_px", 0.0, 2.0, look.optics.blur_sigma_px);
  optics.read_in("glare", 0.0, 0.5, look.optics.glare);
  optics.read_in("vignette", 0.0, 2.0, look.optics.vignette);
  optics.read_in("windscreen_parallax_mm", 0.0, 50.0, look.optics.windscreen_parallax_mm);
  ConfigTable sensor = root.table("sensor");
  SensorLook& s = look.sensor;
  sensor.read_in("responsivity", 1.0, 1e9, s.responsivity);
  sensor.read_in("full_well_e", 100.0, 1e7, s.full_well_e);
  sensor.read_in("bits", 8, 16, s.bits);
  if (s.bits % 2 != 0 || s.bits == 14) sensor.fail("bits", "is " + std::to_string(s.bits) + ", expected 8, 10, 12 or 16");
  sensor.read_in("gain", 0.1, 100.0, s.gain);
  sensor.read_in("black_level", 0.0, 0.5, s.black_level);
  sensor.read_in("read_noise_e", 0.0, 1000.0, s.read_noise_e);
  sensor.read("photon_noise", s.photon_noise);
  sensor.read_in("prnu", 0.0, 0.2, s.prnu);
  sensor.read_in("transfer_ms", 0.0, 10.0, s.transfer_ms);
  sensor.read_in("blooming", 0.0, 1.0, s.blooming);
  sensor.read_in("dead_pixels", 0, 10000, s.dead_pixels);
}

}  // namespace cyclops::hil
