#pragma once
/// Where the two aircraft really are at any time.
///
/// Both follow the scenario's way (hil/way.hpp) with their own gusts. Position is a smooth function of time; velocity is its
/// derivative. Attitude follows from it as an aircraft's must: lift carries the specific force across the way through the air
/// (a coordinated turn), angle of attack grows with the load, then the gusts' own part is added. Body rates are the
/// derivatives of attitude.
///
/// Time     seconds from the start of the flight. Frames and units as in flight_messages.hpp.
/// Threads  const use from any. Repeatable: a function of scenario and seed; fewer frames give the beginning of the same motion.
#include "hil/flight_messages.hpp"
#include "hil/scenario.hpp"
#include "hil/smooth.hpp"

namespace cyclops::hil {

/// What the air sees of an aircraft, rad.
struct AirAngles { double alpha{0}, beta{0}; };

class Motion {
 public:
  Motion(const Scenario& scenario, std::uint64_t seed);
  [[nodiscard]] AircraftState tanker(double t_s) const { return state(tanker_, t_s); }
  [[nodiscard]] AircraftState receiver(double t_s) const { return state(receiver_, t_s); }
  /// Angle of attack and sideslip, from velocity, wind and attitude.
  [[nodiscard]] AirAngles air_angles(const AircraftState& state) const;

 private:
  struct Track {
    Smooth<3> position;  ///< ECEF from the anchor, m
    Smooth<3> attitude;  ///< heading (not wrapped), pitch, bank, rad
  };
  [[nodiscard]] Smooth<3> attitude_of(const Smooth<3>& position, double alpha_rad, const Gusts& gusts, std::uint64_t seed, const std::vector<double>& roughness) const;
  [[nodiscard]] AircraftState state(const Track& track, double t_s) const;
  Vec3 anchor_e_{0, 0, 0}, wind_n_{0, 0, 0};
  double speed_mps_{0};
  Track tanker_, receiver_;
};

[[nodiscard]] Pose<frame::R, frame::K> relative(const AircraftState& receiver, const AircraftState& tanker);

}  // namespace cyclops::hil
