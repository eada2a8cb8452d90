#include "tools/web_feed.hpp"

#include <sodium.h>

#include <nlohmann/json.hpp>

#include "wire/channels.hpp"

namespace cyclops::tools {
namespace {

using nlohmann::json;

constexpr std::size_t kMostEvents = 40;
constexpr std::int64_t kLeast_ns = 10'000'000;   // between two HEALTH for viewers: a flood must not cost a core

/// What came over the network may hold any bytes: bad UTF-8 is replaced, never thrown at.
std::string dumped(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

std::string base64(const std::vector<std::uint8_t>& bytes) {
  std::string out(sodium_base64_ENCODED_LEN(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(out.data(), out.size(), bytes.data(), bytes.size(), sodium_base64_VARIANT_ORIGINAL);
  out.pop_back();  // its closing zero
  return out;
}

bool is_jpeg(const std::vector<std::uint8_t>& bytes) { return bytes.size() > 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes.size() < (std::size_t{1} << 20); }

json alarms_json(const health_t& h) {
  json list = json::array();
  for (const alarm_t& a : h.alarms)
    list.push_back({{"name", a.name}, {"level", a.level}, {"text", a.text}, {"quantity", a.quantity}, {"unit", a.unit}, {"value", a.value}, {"limit", a.limit},
                    {"since_s", static_cast<double>(h.service_time_ns - a.since_ns) * 1e-9}});
  return list;
}

json numbers_json(const health_t& h) {
  return {{"number", h.number}, {"state", h.state}, {"version", h.version}, {"profile", h.profile}, {"uptime_s", h.uptime_s}, {"frame_rate_hz", h.frame_rate_hz},
          {"frame_rate_share", h.frame_rate_share}, {"frame_age_ms", h.frame_age_ms}, {"measurement_age_ms", h.measurement_age_ms}, {"frames_received", h.frames_received}, {"frames_incomplete", h.frames_incomplete},
          {"frames_lost", h.frames_lost}, {"frames_lost_1s", h.frames_lost_1s}, {"time_source", h.time_source}, {"time_sigma_us", h.time_sigma_us},
          {"strobe_rate_hz", h.strobe_rate_hz}, {"strobe_age_s", h.strobe_age_s}, {"gps_sigma_us", h.gps_sigma_us}, {"gps_age_s", h.gps_age_s}, {"tspi_receiver_age_ms", h.tspi_receiver_age_ms}, {"tspi_tanker_age_ms", h.tspi_tanker_age_ms},
          {"tspi_receiver_silence_ms", h.tspi_receiver_silence_ms}, {"tspi_tanker_silence_ms", h.tspi_tanker_silence_ms}, {"tspi_receiver_rate_hz", h.tspi_receiver_rate_hz},
          {"tspi_tanker_rate_hz", h.tspi_tanker_rate_hz}, {"nav_contradicted", h.nav_contradicted != 0}, {"authenticated", h.authenticated != 0}, {"refused_1s", h.refused_1s},
          {"range_m", h.range_m}, {"closure_mps", h.closure_mps}, {"features_visible", h.features_visible}, {"features_matched", h.features_matched},
          {"tracks_live", h.tracks_live}, {"tracks_coasting", h.tracks_coasting}, {"tracks_dropped", h.tracks_dropped}, {"consensus_share", h.consensus_share},
          {"residual_rms_px", h.residual_rms_px}, {"nis_mean", h.nis_mean}, {"integrity", h.integrity}, {"chain_us_p50", h.chain_us_p50}, {"chain_us_p99", h.chain_us_p99},
          {"latency_ms_p50", h.latency_ms_p50}, {"latency_ms_p99", h.latency_ms_p99}, {"latency_ms_max", h.latency_ms_max}, {"disk_left_min", h.disk_left_min},
          {"load", h.load}, {"temperature_c", h.temperature_c}, {"cpu_percent", h.cpu_percent}, {"memory_mb", h.memory_mb}, {"open_files", h.open_files}};
}

json clock_json(const clock_state_t& c) {
  return {{"gps_source", c.gps_source}, {"gps_offset_ns", c.gps_offset_ns}, {"gps_drift_ppm", c.gps_drift_ppm}, {"gps_drift_sigma_ppm", c.gps_drift_sigma_ppm},
          {"gps_sigma_us", c.gps_sigma_us}, {"gps_age_s", c.gps_age_s}, {"gps_marks", c.gps_marks}, {"gps_contradictions", c.gps_contradictions}, {"gps_relocks", c.gps_relocks},
          {"pps_edges", c.pps_edges}, {"pps_missed", c.pps_missed}, {"pps_lost", c.pps_lost}, {"strobe_locked", c.strobe_locked != 0}, {"camera_drift_ppm", c.camera_drift_ppm},
          {"camera_drift_sigma_ppm", c.camera_drift_sigma_ppm}, {"camera_sigma_us", c.camera_sigma_us}, {"camera_age_s", c.camera_age_s}, {"edge_scatter_us", c.edge_scatter_us}, {"lock_count", c.lock_count}};
}

json events_json(const Board& board, std::int64_t now_ns) {
  json list = json::array();
  for (auto e = board.events().rbegin(); e != board.events().rend() && list.size() < kMostEvents; ++e)
    list.push_back({{"age_s", static_cast<double>(now_ns - e->t_ns) * 1e-9}, {"level", e->event.level}, {"source", e->event.source}, {"code", e->event.code}, {"text", e->event.text}});
  return list;
}

}  // namespace

std::string health_json(const Board& board, std::int64_t now_ns) {
  json j{{"age_s", board.health_age_s(now_ns)}, {"stale", board.stale(now_ns)}, {"health_lost", board.health_lost()}, {"refused", board.refused()}, {"events", events_json(board, now_ns)}};
  if (!board.health()) return dumped(j);
  const health_t& h = *board.health();
  j["health"] = numbers_json(h);
  j["alarms"] = alarms_json(h);
  if (board.clock()) j["clock"] = clock_json(*board.clock());
  json counters = json::object();
  for (const counter_t& c : h.counters) counters[c.name] = c.value;
  j["counters"] = std::move(counters);
  return dumped(j);
}

std::string frame_json(const Picture& p) {
  json points = json::array();
  for (const prediction_t& q : p.prediction.items) {
    if (q.visibility != prediction_t::VISIBLE) continue;
    json point{{"id", q.id}, {"p", {q.uv_px[0], q.uv_px[1]}}, {"cov", {q.cov_px2[0], q.cov_px2[1], q.cov_px2[2]}}, {"gate", q.gate_px}};
    for (const measurement_t& m : p.measurement.items) {
      if (m.id != q.id) continue;
      point["accepted"] = m.accepted != 0;
      point["reason"] = m.reason;
      if (!m.accepted && m.reason != measurement_t::INNOVATION) continue;
      point["m"] = {m.raw_px[0], m.raw_px[1]};
      point["mcov"] = {m.cov_px2[0], m.cov_px2[1], m.cov_px2[2]};
      point["kind"] = m.kind;
    }
    points.push_back(std::move(point));
  }
  json j{{"seq", p.seq}, {"width", p.frame.width_px}, {"height", p.frame.height_px}, {"integrity", p.measurement.integrity}, {"from_nav", p.prediction.from_nav != 0},
         {"accepted", p.measurement.accepted}, {"points", std::move(points)}};
  if (is_jpeg(p.frame.thumbnail_jpeg)) j["jpeg"] = base64(p.frame.thumbnail_jpeg);
  return dumped(j);
}

void WebFeed::put(std::string_view name, const void* data, std::size_t size, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (!board_.take(name, data, size, now_ns)) return;
  if (name == channel::kHealth) {
    if (last_health_ns_ != 0 && now_ns - last_health_ns_ < kLeast_ns) return;
    health_ = std::make_shared<const std::string>(health_json(board_, now_ns));
    last_health_ns_ = now_ns;
    ++health_number_;
  } else if (name == channel::kMeasurement && board_.thumbnail().seq != last_thumbnail_) {
    frame_ = std::make_shared<const std::string>(frame_json(board_.thumbnail()));
    last_thumbnail_ = board_.thumbnail().seq;
    ++frame_number_;
  } else {
    return;
  }
  changed_.notify_all();
}

WebFeed::News WebFeed::wait(std::uint64_t health_number, std::uint64_t frame_number, int timeout_ms) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::milliseconds(timeout_ms), [&] { return stopped_ || health_number_ != health_number || frame_number_ != frame_number; });
  News news{health_number_, frame_number_, {}, {}, stopped_};
  if (health_number_ != health_number) news.health = health_;
  if (frame_number_ != frame_number) news.frame = frame_;
  return news;
}

std::string WebFeed::history(std::int64_t now_ns) const {
  const std::lock_guard lock(mutex_);
  json j;
  const auto add = [&](const char* name, auto get) {
    json list = json::array();
    for (const Sample& s : board_.samples()) list.push_back(get(s));
    j[name] = std::move(list);
  };
  add("age_s", [&](const Sample& s) { return static_cast<double>(now_ns - s.t_ns) * 1e-9; });
  add("range_m", [](const Sample& s) { return s.range_m; });
  add("closure_mps", [](const Sample& s) { return s.closure_mps; });
  add("frame_rate_hz", [](const Sample& s) { return s.frame_rate_hz; });
  add("latency_ms_p99", [](const Sample& s) { return s.latency_p99_ms; });
  add("residual_rms_px", [](const Sample& s) { return s.residual_px; });
  add("time_sigma_us", [](const Sample& s) { return s.time_sigma_us; });
  add("features_matched", [](const Sample& s) { return s.matched; });
  add("features_visible", [](const Sample& s) { return s.visible; });
  add("frames_lost", [](const Sample& s) { return s.lost; });
  add("alarms", [](const Sample& s) { return s.alarms; });
  return dumped(j);
}

std::string WebFeed::health(std::int64_t now_ns) const {
  const std::lock_guard lock(mutex_);
  return health_json(board_, now_ns);
}

void WebFeed::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
}

}  // namespace cyclops::tools
