#include "geometry/earth.hpp"

#include <GeographicLib/Constants.hpp>
#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/Math.hpp>
#include <cmath>

namespace cyclops {

Point<frame::E> ecef_from_geodetic(const Geodetic& place) {
  Vec3 p;
  GeographicLib::Geocentric::WGS84().Forward(place.latitude_deg, place.longitude_deg, place.height_m, p.x(), p.y(), p.z());
  return Point<frame::E>(p);
}

Geodetic geodetic_from_ecef(const Point<frame::E>& p) {
  Geodetic place;
  GeographicLib::Geocentric::WGS84().Reverse(p.xyz.x(), p.xyz.y(), p.xyz.z(), place.latitude_deg, place.longitude_deg, place.height_m);
  return place;
}

Rotation<frame::E, frame::N> level_axes(double latitude_deg, double longitude_deg) {
  double sb = 0, cb = 1, sl = 0, cl = 1;
  GeographicLib::Math::sincosd(latitude_deg, sb, cb);
  GeographicLib::Math::sincosd(longitude_deg, sl, cl);
  Mat3 m;
  m << -sb * cl, -sl, -cb * cl,  //
      -sb * sl, cl, -cb * sl,    //
      cb, 0, -sb;
  return Rotation<frame::E, frame::N>(m);
}

Vec3 transport_rate(const Geodetic& place, const Vec3& v) {
  static const double a = GeographicLib::Constants::WGS84_a();
  static const double f = GeographicLib::Constants::WGS84_f();
  const double e2 = f * (2 - f);
  double s = 0, c = 1;
  GeographicLib::Math::sincosd(place.latitude_deg, s, c);
  const double w2 = 1 - e2 * s * s;
  const double across = a / std::sqrt(w2) + place.height_m;                // radius east-west
  const double along = a * (1 - e2) / (w2 * std::sqrt(w2)) + place.height_m;  // radius north-south
  const double turn = std::abs(place.latitude_deg) > 89 ? 0 : -v.y() * s / (c * across);
  return {v.y() / across, -v.x() / along, turn};
}

}  // namespace cyclops
