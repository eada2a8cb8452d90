#pragma once
/// WGS-84: geodetic position, ECEF, and the level axes (north, east, down) of a place.
///
/// Units    degrees in and out because that is how positions are given; metres; ECEF axes.
/// Poles    north is the limit along the meridian given by the longitude, so every place has level axes.
/// Source   GeographicLib::Geocentric; transport rate: Groves, Principles of GNSS, 2nd ed., eq. 5.44.
/// Threads  any; no heap.
#include "geometry/frames.hpp"

namespace cyclops {

struct Geodetic {
  double latitude_deg{0};   ///< -90 .. 90
  double longitude_deg{0};  ///< any; returned in -180 .. 180
  double height_m{0};       ///< above the ellipsoid
};

[[nodiscard]] Point<frame::E> ecef_from_geodetic(const Geodetic& place);
[[nodiscard]] Geodetic geodetic_from_ecef(const Point<frame::E>& p);
/// Columns are north, east and down of the place in ECEF.
[[nodiscard]] Rotation<frame::E, frame::N> level_axes(double latitude_deg, double longitude_deg);
/// Turn rate of the level axes of a vehicle relative to the earth, in those axes, rad/s. Within one degree of a pole the
/// part about the vertical is left out: there, north turns faster than any aircraft.
[[nodiscard]] Vec3 transport_rate(const Geodetic& place, const Vec3& velocity_ned_mps);

}  // namespace cyclops
