#include "hil/flight_messages.hpp"

#include <GeographicLib/Geocentric.hpp>

namespace cyclops::hil {
namespace {

const GeographicLib::Geocentric& earth() { return GeographicLib::Geocentric::WGS84(); }

Mat3 ned_axes(const std::vector<double>& enu) {  // GeographicLib: row-major, columns east north up
  Mat3 m;
  for (int i = 0; i < 3; ++i) m.row(i) << enu[static_cast<std::size_t>(3 * i + 1)], enu[static_cast<std::size_t>(3 * i)], -enu[static_cast<std::size_t>(3 * i + 2)];
  return m;
}

}  // namespace

Local local_from_ecef(const Vec3& p) {
  Local l;
  std::vector<double> M(9);
  earth().Reverse(p.x(), p.y(), p.z(), l.latitude_deg, l.longitude_deg, l.height_m, M);
  l.ecef = p;
  l.R_e_n = ned_axes(M);
  return l;
}

Local local_from_geodetic(double latitude_deg, double longitude_deg, double height_m) {
  Local l{Vec3::Zero(), latitude_deg, longitude_deg, height_m, Mat3::Identity()};
  std::vector<double> M(9);
  earth().Forward(latitude_deg, longitude_deg, height_m, l.ecef.x(), l.ecef.y(), l.ecef.z(), M);
  l.R_e_n = ned_axes(M);
  return l;
}

tspi_t tspi_message(int aircraft, std::int64_t gps_ns, int seq, const AircraftState& s) {
  const Local at = local_from_ecef(s.position_e);
  tspi_t m{};
  m.gps_time_ns = gps_ns;
  m.seq = seq;
  m.aircraft = static_cast<std::int8_t>(aircraft);
  m.status = tspi_t::STATUS_GOOD;
  m.latitude_deg = at.latitude_deg;
  m.longitude_deg = at.longitude_deg;
  m.height_m = at.height_m;
  const Vec3 v = at.R_e_n.transpose() * s.velocity_e;
  Eigen::Quaterniond q(Mat3(at.R_e_n.transpose() * s.R_e_b));
  q.normalize();
  const double w[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy(w, w + 4, m.q_n_b);
  for (int i = 0; i < 3; ++i) {
    m.velocity_ned_mps[i] = v[i];
    m.rate_b_rps[i] = s.rate_b_rps[i];
    m.position_sigma_m[i] = s.position_sigma_m[i];
    m.velocity_sigma_mps[i] = s.velocity_sigma_mps;
    m.attitude_sigma_rad[i] = s.attitude_sigma_rad[i];
  }
  return m;
}

Result<> ArrivalQueue::write(FlightWriter& out) {
  std::stable_sort(pending_.begin(), pending_.end(), [](const Pending& a, const Pending& b) { return a.arrival_ns < b.arrival_ns; });
  for (const Pending& p : pending_) CYCLOPS_TRY(out.message(Time{p.arrival_ns}, p.channel.c_str(), p.bytes.data(), p.bytes.size()));
  pending_.clear();
  return Ok{};
}

}  // namespace cyclops::hil
