#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include <cyclops/health_t.hpp>

#include "service/pipeline_state.hpp"

namespace cyclops {
namespace {

float milliseconds(Duration d) { return static_cast<float>(static_cast<double>(d.ns) * 1e-6); }
float microseconds(Duration d) { return static_cast<float>(static_cast<double>(d.ns) * 1e-3); }

float rate(std::uint64_t now, std::uint64_t before, double window_s) {
  return window_s > 0 && now >= before ? static_cast<float>(static_cast<double>(now - before) / window_s) : 0.0F;
}

float hottest_c() {
  float most = -1;
  for (int zone = 0; zone < 8; ++zone) {
    char path[64];
    std::snprintf(path, sizeof path, "/sys/class/thermal/thermal_zone%d/temp", zone);
    std::FILE* f = std::fopen(path, "r");
    if (f == nullptr) break;
    int milli = 0;
    if (std::fscanf(f, "%d", &milli) == 1) most = std::max(most, static_cast<float>(milli) * 1e-3F);
    std::fclose(f);
  }
  return most;
}

void add(health_t& out, const char* name, std::uint64_t value) {
  const auto i = static_cast<std::size_t>(out.n_counters++);
  if (out.counters.size() <= i) out.counters.resize(i + 1);
  out.counters[i].name = name;
  out.counters[i].value = static_cast<std::int64_t>(value);
}

void add_counters(health_t& out, const Pipeline::State& s, const ChainCounts& c, const CameraCounters& camera, const StrobeStatus& strobe, const LinkCounts (&link)[2]) {
  out.n_counters = 0;
  add(out, "capture.complete", camera.received);
  add(out, "capture.incomplete", camera.incomplete);
  add(out, "capture.lost.gap", camera.lost_gap);
  add(out, "capture.lost.leader", camera.lost_leader);
  add(out, "capture.lost.no_buffer", camera.lost_no_buffer);
  add(out, "capture.lost.size_mismatch", camera.lost_size_mismatch);
  add(out, "capture.lost.rows_unknown", camera.lost_rows_unknown);
  add(out, "capture.lost.frozen", camera.lost_frozen);
  add(out, "capture.resent_packets", camera.packets.resent);
  add(out, "capture.starts", camera.starts);
  add(out, "service.queue_full", s.inputs.refused());
  add(out, "service.no_room", c.front_refused);
  add(out, "service.room_flushed", c.room_flushed);
  add(out, "time.edges", c.stamp.edges);
  add(out, "time.edges_lost", c.stamp.edges_lost_seq + c.stamp.edges_lost_inferred);
  add(out, "time.edges_spurious", c.stamp.edges_spurious);
  add(out, "time.edges_doubled", c.stamp.edges_doubled);
  add(out, "time.frames_without_edge", c.stamp.no_edge_lost + c.stamp.no_edge_waited + c.stamp.no_edge_beside);
  add(out, "time.locks", c.stamp.lock_count);
  add(out, "strobe.lost", strobe.lost);
  add(out, "strobe.disconnects", strobe.disconnects);
  static constexpr const char* kNames[2][6] = {
      {"tspi.receiver.received", "tspi.receiver.refused", "tspi.receiver.guarded", "tspi.receiver.out_of_order", "tspi.receiver.duplicate", "tspi.receiver.missing"},
      {"tspi.tanker.received", "tspi.tanker.refused", "tspi.tanker.guarded", "tspi.tanker.out_of_order", "tspi.tanker.duplicate", "tspi.tanker.missing"}};
  for (int a = 0; a < 2; ++a) {
    add(out, kNames[a][0], link[a].received);
    add(out, kNames[a][1], link[a].refused);
    add(out, kNames[a][2], link[a].guarded);
    add(out, kNames[a][3], c.tspi[a].out_of_order_inserted);
    add(out, kNames[a][4], c.tspi[a].duplicate);
    add(out, kNames[a][5], c.tspi[a].missing);
  }
  add(out, "nav.timed_out", c.aligner.timed_out);
  add(out, "nav.without_nav", c.aligner.without_nav);
  add(out, "chain.consensus", c.consensus);
  add(out, "service.events_lost", s.events.lost());
}

void add_counters(health_t& out, const RecordCounts& r) {
  add(out, "record.frames", r.frames);
  add(out, "record.lost.queue_full", r.frames_queue_full);
  add(out, "record.lost.disk_full", r.frames_disk_full);
  add(out, "record.lost.disk_error", r.frames_disk_error);
  add(out, "record.inputs", r.inputs);
  add(out, "record.inputs_lost", r.inputs_lost);
  add(out, "record.published", r.published);
  add(out, "record.published_lost", r.published_lost);
  add(out, "record.frame_megabytes", r.bytes >> 20);
}

}  // namespace

void fill_clock(clock_state_t& out, const ChainCounts& chain, const StrobeStatus& pps) {
  const ClockState& c = chain.clocks;
  const auto us = [](Duration d) { return static_cast<double>(d.ns) * 1e-3; };
  out.service_time_ns = c.t.ns;
  out.gps_source = static_cast<std::int8_t>(c.gps_source);
  out.gps_offset_ns = c.gps_offset.ns;
  out.gps_drift_ppm = c.gps_drift_ppm;
  out.gps_drift_sigma_ppm = c.gps_drift_sigma_ppm;
  out.gps_sigma_us = us(c.gps_sigma);
  out.gps_age_s = c.gps_age.seconds();
  out.gps_marks = static_cast<std::int64_t>(chain.gps.marks);
  out.gps_contradictions = static_cast<std::int64_t>(chain.gps.contradictions);
  out.gps_relocks = static_cast<std::int64_t>(chain.gps.relocks);
  out.pps_edges = static_cast<std::int64_t>(chain.pps.edges);
  out.pps_missed = static_cast<std::int64_t>(chain.pps.missed);
  out.pps_lost = static_cast<std::int64_t>(pps.lost);
  out.strobe_locked = c.strobe_locked ? 1 : 0;
  out.camera_drift_ppm = c.camera_drift_ppm;
  out.camera_drift_sigma_ppm = c.camera_drift_sigma_ppm;
  out.camera_sigma_us = us(c.camera_sigma);
  out.camera_age_s = c.camera_age.seconds();
  out.edge_scatter_us = c.edge_scatter_us;
  out.lock_count = static_cast<std::int64_t>(chain.stamp.lock_count);
}

static_assert(static_cast<std::int8_t>(GpsSource::kNone) == clock_state_t::NONE && static_cast<std::int8_t>(GpsSource::kArrival) == clock_state_t::ARRIVAL &&
              static_cast<std::int8_t>(GpsSource::kTimeMark) == clock_state_t::TIME_MARK);

void fill_health(health_t& out, const Pipeline::State& s, const ChainCounts& c, const ChainCounts& before, const CameraCounters& camera,
                 const StrobeStatus& strobe, const LinkCounts (&link)[2], double window_s) {
  const FrameFacts& f = s.facts;
  const bool tspi = c.has_tspi[0] && c.has_tspi[1];
  const bool camera_there = s.camera_there;
  out.service_time_ns = host_now_ns();
  out.state = s.stopping ? health_t::STOPPING : !camera_there ? (c.frames == 0 ? health_t::STARTING : health_t::NO_CAMERA) : tspi ? health_t::RUNNING : health_t::NO_NAV;
  out.version = CYCLOPS_VERSION;
  out.profile = s.profile.name;
  out.uptime_s = static_cast<float>(static_cast<double>(host_now_ns() - s.started_ns) * 1e-9);
  out.frame_rate_hz = rate(c.frames, before.frames, window_s);
  out.frames_received = static_cast<std::int64_t>(camera.received);
  out.frames_incomplete = static_cast<std::int64_t>(camera.incomplete);
  out.frames_lost = static_cast<std::int64_t>(camera.lost_gap + camera.lost_leader + camera.lost_no_buffer + camera.lost_size_mismatch + camera.lost_rows_unknown + camera.lost_frozen + c.front_refused);
  out.time_source = static_cast<std::int8_t>(f.time_source);
  out.time_sigma_us = microseconds(f.t_mid_sigma);
  out.strobe_rate_hz = rate(c.stamp.edges, before.stamp.edges, window_s);
  out.tspi_receiver_age_ms = c.has_tspi[0] ? milliseconds(f.t_mid - c.newest_tspi[0]) : -1.0F;
  out.tspi_tanker_age_ms = c.has_tspi[1] ? milliseconds(f.t_mid - c.newest_tspi[1]) : -1.0F;
  out.tspi_receiver_rate_hz = rate(c.tspi[0].accepted, before.tspi[0].accepted, window_s);
  out.tspi_tanker_rate_hz = rate(c.tspi[1].accepted, before.tspi[1].accepted, window_s);
  out.range_m = static_cast<float>(f.range_m);
  out.closure_mps = static_cast<float>(f.closure_mps);
  out.features_visible = f.visible;
  out.features_matched = f.matched;
  out.tracks_live = f.live;
  out.tracks_coasting = f.coasting;
  out.tracks_dropped = static_cast<std::int64_t>(c.track.dropped);
  out.residual_rms_px = static_cast<float>(f.residual_rms_px);
  out.nis_mean = static_cast<float>(f.nis_mean);
  out.integrity = static_cast<float>(f.integrity);
  out.chain_us_p50 = microseconds(s.chain_recent.quantile(0.5));
  out.chain_us_p99 = microseconds(s.chain_recent.quantile(0.99));
  out.latency_ms_p50 = milliseconds(s.latency_recent.quantile(0.5));
  out.latency_ms_p99 = milliseconds(s.latency_recent.quantile(0.99));
  out.latency_ms_max = milliseconds(s.latency_recent.max());
  const RecordCounts record = s.recorder ? s.recorder->counts() : RecordCounts{};
  out.disk_left_min = record.disk_left_min;
  double load[1] = {0};
  out.load = getloadavg(load, 1) == 1 ? static_cast<float>(load[0]) : -1.0F;
  out.temperature_c = hottest_c();
  add_counters(out, s, c, camera, strobe, link);
  if (record.on) add_counters(out, record);
  out.n_alarms = 0;
  out.alarms.clear();
  if (out.state == health_t::NO_CAMERA) out.alarms.emplace_back("camera is silent");
  if (out.state == health_t::NO_NAV) out.alarms.emplace_back(c.has_tspi[0] ? "no TSPI of the tanker" : c.has_tspi[1] ? "no TSPI of the receiver" : "no TSPI");
  if (f.time_source != TimeSource::kStrobe && c.frames > 0) out.alarms.emplace_back("frame time is not from the strobe");
  if (f.nav_suspect) out.alarms.emplace_back("TSPI contradicts the picture");
  out.n_alarms = static_cast<std::int32_t>(out.alarms.size());
}

}  // namespace cyclops
