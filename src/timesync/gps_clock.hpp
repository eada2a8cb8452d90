#pragma once
#include <optional>
#include "base/config.hpp"
#include "msg/strobe.hpp"
namespace cyclops {
struct GpsClockConfig {};
class GpsClock {
 public:
  explicit GpsClock(const GpsClockConfig&) {}
  void on_mark(const TimeMark& m) { if (!o_) o_ = m.t.ns - m.t_gps.ns; }
  void on_tspi_arrival(GpsTime, Time) {}
  std::optional<Time> to_service(GpsTime g) const { if (!o_) return std::nullopt; return Time{g.ns + *o_}; }
  std::optional<GpsTime> to_gps(Time t) const { if (!o_) return std::nullopt; return GpsTime{t.ns - *o_}; }
 private: std::optional<std::int64_t> o_;
};
}
