#pragma once
/// A scenario: what a generated flight shows and how wrong its navigation is. TOML, an unknown key stops the start.
///
/// Units    as the names say: people write these files. Angles of the approach are those of the receiver's nose seen from the
///          aft tip of the tanker's fuselage: azimuth + right, elevation + up.
/// Errors   file:line: key, value and range.
#include <string>

#include "base/result.hpp"
#include "geometry/camera.hpp"
#include "hil/render.hpp"

namespace cyclops::hil {

struct Scenario {
  std::string name{"flight"};
  int frames{300};
  std::int64_t seed{1};
  Intrinsics camera{};
  double frame_rate_hz{30}, exposure_us{4000}, tick_drift_ppm{20}, readout_ms{8};
  double windscreen{0};                    ///< size of the made-up windscreen, hil/made_up_windscreen.hpp; 0: none
  MountAngles mount{0, 0.27925268031909273, 0};
  Vec3 lens_in_receiver_m{2.4, 0, -0.6};
  Vec3 nose_from_lens_m{2.286, 0, 0.457};  ///< receiver body: the lens is 90 in aft of the nose and 18 in above
  double boresight_error_deg{0};           ///< 1 sigma an axis of the constant error that is drawn; also told in rig.toml
  std::string tanker;                      ///< path of the feature table, inches
  Vec3 ins_in{190, 0, 95};                 ///< tanker INS, model axes, inches
  Vec3 reference_in{511, 0, 123};          ///< range counts from here
  double latitude_deg{35}, longitude_deg{-118}, height_m{6000}, speed_mps{110}, heading_deg{70};
  double range_ft{97}, closing_ftps{1.4}, elevation_deg{-15}, azimuth_deg{0};
  double wander_position_m{0.15}, wander_attitude_deg{0.7}, wander_period_s{8};
  double tspi_rate_hz{50}, tspi_latency_ms{15}, tspi_latency_jitter_ms{0}, tspi_tau_s{30};  ///< latency: evenly within +- jitter
  double position_sigma_m{0}, attitude_sigma_deg{0}, velocity_sigma_mps{0}, rate_sigma_dps{0};
  double projection_error_px{0};           ///< above 0: the drawn errors are scaled so that this is their mean on the image
  double sun_azimuth_deg{200}, sun_elevation_deg{40};
  Look look{};

  static Result<Scenario> load(const std::string& path);
  static Result<Scenario> parse(const std::string& text, const std::string& name);
};

}  // namespace cyclops::hil
