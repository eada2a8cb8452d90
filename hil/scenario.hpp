#pragma once
/// A scenario: what a generated flight shows and how wrong its navigation is. TOML; docs/flights.md says every key.
///
/// Base     `base = "other.toml"` reads that file first; what this one says goes over it. An unknown key stops the start.
/// Units    as the names say: people write these files. Places of the receiver are those of its nose seen from the aft tip of
///          the tanker's fuselage, in axes that head and bank with the tanker and do not shake with it: azimuth + right,
///          elevation + up (spec 3.2).
/// Errors   file:line: key, value and range.
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/camera.hpp"
#include "hil/mesh_file.hpp"
#include "hil/render.hpp"
#include "hil/wander.hpp"

namespace cyclops::hil {

/// A stretch of the receiver's way: at constant rates, or from where it is to a place, starting and ending at rest.
struct Leg {
  std::string name;                        ///< for the figures
  double for_s{0};
  double closing_ftps{0}, right_ftps{0}, up_ftps{0};
  double gusts{1};                         ///< the attitude part of both aircraft's gusts, times this
  bool to_place{false};
  double range_ft{0}, azimuth_deg{0}, elevation_deg{0};  ///< with to_place
};
/// From `at_s`, within `over_s`, both aircraft take the bank and keep it: a coordinated turn.
struct Turn { double at_s{0}, bank_deg{0}, over_s{4}; };
/// One aircraft alone rolls to both sides (spec 3.4), swaying as that makes it.
struct WingRock { bool tanker{false}; double at_s{1}, bank_deg{15}, period_s{4}; int cycles{2}; };

/// Unwanted motion of one aircraft, 1 sigma.
struct Gusts {
  WanderShape along_m{0.10, 0.05, 0.7}, right_m{0.08, 0.08, 0.6}, down_m{0.08, 0.10, 0.6};  ///< place, the pilot's loop
  WanderShape bank_deg{0.3, 0.5, 0.7}, pitch_deg{0.15, 0.6, 0.5}, yaw_deg{0.12, 0.4, 0.3};  ///< attitude beside what the way asks for
};

enum class Reduction { kBody, kFlightPath };

/// Errors of the measured TSPI. Every sigma is that of one aircraft and axis.
struct Navigation {
  bool is_true{false};                     ///< no errors at all; the link stays as it is
  std::int64_t seed{1};
  double rate_hz{50};
  double position_sigma_m{0}, position_tau_s{30};        ///< Gauss-Markov, not shared by the aircraft
  double shared_position_sigma_m{0};                     ///< the same for both at any time: same satellites
  double attitude_sigma_deg{0}, attitude_tau_s{30};
  double velocity_sigma_mps{0}, rate_sigma_dps{0};       ///< white
  double boresight_sigma_deg{0};                         ///< rig file against the real mount, an axis
  double lever_arm_sigma_m{0};                           ///< rig file against the real places of lens and INS
  Reduction reduction{Reduction::kBody};                 ///< kFlightPath: angle of attack and drift forgotten (spec 3.5)
  double stated_sigma_factor{1};                         ///< stated over true; 1 is honest
  bool stated_sigma_follows{true};                       ///< the stated sigmas know of the error's course below
  std::vector<double> error_at_s, error_px;              ///< course of the mean error on the image; empty: as drawn
  double error_spread{0};                                ///< the course varies by this much (natural logarithm, 1 sigma) from seed to seed
  double latency_ms{15}, latency_jitter_ms{0};           ///< evenly within +- jitter, in order
  // The tanker's reports come over a radio link.
  double link_latency_ms{0};                             ///< on top
  double dropouts_per_minute{0}, dropout_s{0.4};         ///< mean length
  double duplicate_share{0}, swapped_share{0};           ///< sent twice; overtaken by the next one
  Vec3 receiver_point_m{0, 0, 0}, tanker_point_m{0, 0, 0};  ///< what TSPI speaks about, from the INS, body axes
};

struct Scenario {
  std::string name{"flight"};
  std::string about;                       ///< one or two sentences for people
  int frames{300};
  std::int64_t seed{1};                    ///< of all that can be seen: motion, sky, noise
  Intrinsics camera{};
  double frame_rate_hz{30}, exposure_us{4000}, tick_drift_ppm{20}, readout_ms{8};
  double windscreen{0};                    ///< size of the made-up windscreen, hil/made_up_windscreen.hpp; 0: none
  double windscreen_sigma_px{0};           ///< above 0: the rig gets a calibration with this error in place of the exact matrices
  MountAngles mount{0, 0.27925268031909273, 0};
  Vec3 lens_in_receiver_m{2.4, 0, -0.6};
  Vec3 nose_from_lens_m{2.286, 0, 0.457};  ///< receiver body: the lens is 90 in aft of the nose and 18 in above
  std::string tanker;                      ///< path of the feature table, inches
  TankerMeshConfig mesh{};                 ///< its shape
  Vec3 ins_in{190, 0, 95};                 ///< tanker INS, model axes, inches
  Vec3 reference_in{511, 0, 123};          ///< range counts from here
  double latitude_deg{35}, longitude_deg{-118}, height_m{6000}, speed_mps{110}, heading_deg{70};  ///< speed through the air
  double wind_north_mps{0}, wind_east_mps{0};
  double tanker_alpha_deg{0.5}, receiver_alpha_deg{5};   ///< angle of attack in level flight (spec 3.5 for the receiver)
  double range_ft{97}, elevation_deg{-15}, azimuth_deg{0};  ///< at the first frame
  double blend_s{1.5};                     ///< rates change within about this time
  std::vector<Leg> legs;                   ///< from the first frame on; after the last one the receiver keeps its place
  std::vector<Turn> turns;                 ///< times count from the first frame
  std::vector<WingRock> wing_rocks;
  Gusts receiver_gusts{}, tanker_gusts{};
  Navigation navigation{};
  Look look{};

  static Result<Scenario> load(const std::string& path);
  static Result<Scenario> parse(const std::string& text, const std::string& name);
};

}  // namespace cyclops::hil
