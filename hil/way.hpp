#pragma once
/// The way that the scenario asks for, before air and pilots have their say: where the tanker flies and where the receiver
/// keeps its nose.
///
/// Time     s from the start of the flight; the scenario's times count from the first frame, kFirstFrame_s later.
/// Threads  const use from any.
#include <vector>

#include "geometry/frames.hpp"
#include "hil/scenario.hpp"

namespace cyclops::hil {

inline constexpr double kFirstFrame_s = 0.5;     ///< TSPI begins before the frames
inline constexpr double kControlRate_hz = 100;
inline constexpr double kControlStart_s = -2;

/// Time of the i-th control value, and how many a flight of this length needs.
[[nodiscard]] inline double control_s(std::size_t i) { return kControlStart_s + static_cast<double>(i) / kControlRate_hz; }
[[nodiscard]] std::size_t control_count(const Scenario& scenario);

/// The tanker's way over the earth at one instant: level at a constant height, turning as its bank asks.
struct Station {
  Vec3 position_e{0, 0, 0};
  Mat3 R_e_h{Mat3::Identity()};   ///< level axes: x along the way through the air, y right, z down
  double bank_rad{0};
};
/// One a control time. Straight flight is a geodesic; wind carries the aircraft sideways.
[[nodiscard]] std::vector<Station> tanker_way(const Scenario& scenario);

/// Nose of the receiver from the tanker's reference point in the banked axes of the station, m; and how rough the air is.
struct Relative {
  Vec3 nose_m{0, 0, 0};
  double gusts{1};
};
/// One a control time, blended as the scenario says.
[[nodiscard]] std::vector<Relative> receiver_way(const Scenario& scenario);

/// Nose of the receiver for a range, an azimuth and an elevation as scenarios give them; axes as above, m.
[[nodiscard]] Vec3 nose_place(double range_ft, double azimuth_deg, double elevation_deg);

/// Sway to the right, m, that rocks the wings of an aircraft which banks as its sideways acceleration asks: a sine in a smooth
/// window, as large as makes the wanted bank once.
class Sway {
 public:
  Sway(const std::vector<WingRock>& rocks, bool tanker);
  [[nodiscard]] double at(double t_s) const;

 private:
  struct Part { double from_s, length_s, size_m; int cycles; };
  [[nodiscard]] static double shape(int cycles, double x);
  std::vector<Part> parts_;
};

}  // namespace cyclops::hil
