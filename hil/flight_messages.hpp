#pragma once
/// What every maker of flights needs: states on the earth as TSPI messages, and messages put in order of arrival.
///
/// Units    SI, rad; times in ns on the clock that a name says.
/// Frames   ECEF and NED on WGS-84; body forward right down.
/// Threads  one at a time.
#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <cyclops/tspi_t.hpp>

#include "geometry/frames.hpp"
#include "record/flight.hpp"

namespace cyclops::hil {

/// A place on the earth and the rotation of its north-east-down axes.
struct Local {
  Vec3 ecef{0, 0, 0};
  double latitude_deg{0}, longitude_deg{0}, height_m{0};
  Mat3 R_e_n{Mat3::Identity()};
};
[[nodiscard]] Local local_from_ecef(const Vec3& p);
[[nodiscard]] Local local_from_geodetic(double latitude_deg, double longitude_deg, double height_m);

/// What a navigation system says about its aircraft at one time.
struct AircraftState {
  Vec3 position_e{0, 0, 0};
  Vec3 velocity_e{0, 0, 0};
  Mat3 R_e_b{Mat3::Identity()};
  Vec3 rate_b_rps{0, 0, 0};          ///< relative to the local level
  Vec3 position_sigma_m{0, 0, 0};    ///< north east down
  double velocity_sigma_mps{0.05};
  Vec3 attitude_sigma_rad{0, 0, 0};  ///< about body x y z
};
[[nodiscard]] tspi_t tspi_message(int aircraft, std::int64_t gps_ns, int seq, const AircraftState& state);

/// Messages wait here until all are known, then are written in order of arrival; equal times keep their order.
class ArrivalQueue {
 public:
  /// `arrival_ns`: service clock.
  template <class M>
  void add(std::int64_t arrival_ns, const char* channel, const M& message) {
    Pending p{arrival_ns, channel, std::vector<std::uint8_t>(static_cast<std::size_t>(message.getEncodedSize()))};
    message.encode(p.bytes.data(), 0, static_cast<int>(p.bytes.size()));
    pending_.push_back(std::move(p));
  }
  /// One that is encoded already.
  void add(std::int64_t arrival_ns, const std::string& channel, const std::vector<std::uint8_t>& bytes) { pending_.push_back({arrival_ns, channel, bytes}); }
  Result<> write(FlightWriter& out);

 private:
  struct Pending {
    std::int64_t arrival_ns;
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };
  std::vector<Pending> pending_;
};

}  // namespace cyclops::hil
