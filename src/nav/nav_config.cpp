#include "nav/nav_config.hpp"

#include <cmath>
#include <functional>
#include <sstream>

namespace cyclops {
namespace {

using Where = std::function<std::string(const char*)>;

constexpr double kLongestLever_m = 100;

struct Range {
  const char* key;
  double NavConfig::*field;
  double low, high;
};
constexpr Range kRanges[] = {
    {"max_wait_ms", &NavConfig::max_wait_ms, 0, 5000},
    {"max_age_ms", &NavConfig::max_age_ms, 0, 10000},
    {"max_gap_ms", &NavConfig::max_gap_ms, 1, 10000},
    {"max_jump_s", &NavConfig::max_jump_s, 0.1, 3600},
    {"acceleration_sigma_mps2", &NavConfig::acceleration_sigma_mps2, 0, 100},
    {"rate_sigma_rps", &NavConfig::rate_sigma_rps, 0, 10},
    {"angular_acceleration_sigma_rps2", &NavConfig::angular_acceleration_sigma_rps2, 0, 100},
    {"position_correlation", &NavConfig::position_correlation, 0, 1},
    {"carry_s", &NavConfig::carry_s, 0, 60},
    {"carry_acceleration_mps2", &NavConfig::carry_acceleration_mps2, 0, 100},
    {"carry_angular_acceleration_rps2", &NavConfig::carry_angular_acceleration_rps2, 0, 100},
    {"update_interval_s", &NavConfig::update_interval_s, 0, 3600},
};

Error outside(const Where& where, const char* key, double value, double low, double high) {
  std::ostringstream what;
  what << "is " << value << ", expected " << low << " to " << high;
  return make_error(ErrorCode::kInvalid, where(key), what.str());
}

Result<> check_dropouts(const NavConfig& config, const Where& where) {
  double last = 0;
  for (const DropoutWindow& w : config.dropouts) {
    if (!(w.start_s >= last && w.end_s > w.start_s && std::isfinite(w.end_s)))
      return make_error(ErrorCode::kInvalid, where("dropouts_s"), "windows must have start < end, be in order and not overlap");
    last = w.end_s;
  }
  return Ok{};
}

Result<> check(const NavConfig& c, const Where& where) {
  for (const Range& r : kRanges)
    if (const double v = c.*r.field; !(v >= r.low && v <= r.high)) return outside(where, r.key, v, r.low, r.high);
  if (c.update_every_n_frames < 1 || c.update_every_n_frames > 100000)
    return outside(where, "update_every_n_frames", c.update_every_n_frames, 1, 100000);
  if (c.max_waiting_frames < 1 || c.max_waiting_frames > 1024)
    return outside(where, "max_waiting_frames", c.max_waiting_frames, 1, 1024);
  if (c.update_interval_s > 0 && c.update_every_n_frames != 1)
    return make_error(ErrorCode::kInvalid, where("update_interval_s"), "is given together with update_every_n_frames, expected one of them");
  if (c.max_gap_ms > 1e3 * c.max_jump_s)
    return make_error(ErrorCode::kInvalid, where("max_gap_ms"), "is longer than max_jump_s, expected at most that");
  return check_dropouts(c, where);
}

}  // namespace

Result<NavConfig> NavConfig::read(ConfigTable& nav, NavConfig config) {
  for (const Range& r : kRanges) nav.read(r.key, config.*r.field);
  nav.read("update_every_n_frames", config.update_every_n_frames);
  nav.read("max_waiting_frames", config.max_waiting_frames);
  std::vector<double> edges;
  nav.read("dropouts_s", edges);
  if (edges.size() % 2 != 0 || edges.size() > 2 * kMaxDropouts)
    return make_error(ErrorCode::kInvalid, nav.where("dropouts_s"),
                      "has " + std::to_string(edges.size()) + " numbers, expected pairs of start and end, at most " + std::to_string(kMaxDropouts));
  if (nav.has("dropouts_s")) config.dropouts.clear();
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2) config.dropouts.push_back({edges[i], edges[i + 1]});
  CYCLOPS_TRY(check(config, [&](const char* key) { return nav.where(key); }));
  return config;
}

Result<> NavConfig::validated() const {
  return check(*this, [](const char* key) { return std::string("nav.") + key; });
}

Result<NavRig> NavRig::read(ConfigTable& tspi) {
  NavRig rig;
  tspi.read_three("receiver_ins_m", kLongestLever_m, rig.receiver_ins_from_tspi_m);
  tspi.read_three("tanker_ins_m", kLongestLever_m, rig.tanker_ins_from_tspi_m);
  return rig;
}

}  // namespace cyclops
