#pragma once
/// How a flight looks: light, sky, lens and sensor. Tables [light], [sky], [optics] and [sensor] of a scenario.
///
/// Units    photometric: cd/m2, lx, electrons, counts. Directions in NED.
/// Defaults are assumptions for a Dalsa 1M60 with a manual f-stop behind a windscreen (spec 3.1): none is a measured value.
#include <cstdint>

#include "base/config.hpp"
#include "geometry/frames.hpp"

namespace cyclops::hil {

struct LightLook {
  double sun_azimuth_deg{200};     ///< from north, clockwise
  double sun_elevation_deg{40};    ///< below 0: twilight; below -12: night
  double uniform_cdm2{-1};         ///< test pattern: from 0 on every surface shines with its albedo times this, no shadows
  [[nodiscard]] Vec3 to_sun_n() const;
};

struct SkyLook {
  double cloud_cover{0};           ///< 0..1 share of the sky with cloud in it
  double cloud_contrast{1};        ///< 0..2 bright edges against dark cores and gaps
  double ground_albedo{0.36};      ///< desert and dry lakes
  double ground_contrast{0.35};    ///< of its texture
  double haze_deg{1.6};            ///< the ground fades into the horizon within this depression
  double uniform_cdm2{-1};         ///< from 0 on: that luminance everywhere in place of a sky
};

struct OpticsLook {
  bool automatic_f_number{true};   ///< set once a flight, as a hand would before take-off, from the sky and white paint; else f_number
  double f_number{11};
  double blur_sigma_px{0.55};      ///< lens; 0: none
  double glare{0.012};             ///< share of light that is scattered in lens and windscreen; 0: none
  double vignette{0.6};            ///< 0: none, 1: cos^4
  double windscreen_parallax_mm{0};  ///< sideways shift of rays, half of it at the middle of an edge: the shift on the picture is f times that over range
};

struct SensorLook {
  double exposure_us{4000};        ///< the scenario fills it from [camera]
  double responsivity{280e3};      ///< electrons N^2 / (s cd/m2)
  double full_well_e{150e3};
  int bits{12};                    ///< 8, 10, 12 or 16
  double gain{1};                  ///< 1: full well fills the range of counts
  double black_level{0.004};       ///< of the range of counts
  double read_noise_e{45};
  bool photon_noise{true};
  double prnu{0.006};              ///< 1 sigma
  double transfer_ms{0.25};        ///< frame transfer under light, smears columns; 0: none
  double blooming{0.12};           ///< share of the charge above full well that spills into its column; 0: none
  int dead_pixels{12};
  [[nodiscard]] int top_count() const { return (1 << bits) - 1; }
  [[nodiscard]] double electrons_per_count() const { return full_well_e / (gain * top_count()); }
};

struct Look {
  LightLook light{};
  SkyLook sky{};
  OpticsLook optics{};
  SensorLook sensor{};
};

/// Reads the four tables; wrong and unknown keys become errors of the file (ConfigFile::finish).
void read_look(ConfigTable& root, Look& look);

}  // namespace cyclops::hil
