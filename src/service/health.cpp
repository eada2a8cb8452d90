#include "service/health.hpp"

#include <algorithm>

namespace cyclops {
namespace {

float milliseconds(Duration d) { return static_cast<float>(static_cast<double>(d.ns) * 1e-6); }
float microseconds(Duration d) { return static_cast<float>(static_cast<double>(d.ns) * 1e-3); }

std::uint64_t lost_frames(const Counts& n) {
  const CameraCounters& c = n.camera;
  return c.lost_gap + c.lost_leader + c.lost_no_buffer + c.lost_size_mismatch + c.lost_rows_unknown + c.lost_frozen + n.chain.front_refused;
}

std::uint64_t refused_messages(const Counts& n) {
  std::uint64_t sum = 0;
  for (const LinkCounts& l : n.link) sum += l.refused + l.flooded + l.not_authentic + l.replayed + l.guarded;
  return sum;
}

void add(health_t& out, const std::string& name, std::uint64_t value) {
  const auto i = static_cast<std::size_t>(out.n_counters++);
  if (out.counters.size() <= i) out.counters.resize(i + 1);
  out.counters[i].name = name;
  out.counters[i].value = static_cast<std::int64_t>(value);
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

HealthMaker::HealthMaker(Pipeline::State& s) : s_(s), alarms_(s.options.limits) {}

bool HealthMaker::look(std::int64_t now_ns) {
  take_counts();
  levels(now_ns);
  rates(now_ns);
  const auto& changes = alarms_.step(out_, Time{now_ns});
  for (const AlarmChange& c : changes) {
    const EventLevel level = !c.on ? EventLevel::kRecovery : c.limit->level == AlarmLevel::kFault ? EventLevel::kFault : EventLevel::kWarning;
    s_.events.post(Time{now_ns}, level, "alarm", c.limit->name.c_str(), c.on ? words(*c.limit, c.value) : "over: " + c.limit->text);
  }
  return !changes.empty();
}

const health_t& HealthMaker::message() {
  ++out_.number;
  counters();
  alarms_.put(out_);
  return out_;
}

void HealthMaker::take_counts() {
  const std::lock_guard lock(s_.counts_mutex);
  n_.chain = s_.chain_counts;
  n_.camera = s_.camera_counts;
  n_.strobe = s_.strobe_status;
  n_.pps = s_.pps_status;
  std::copy(std::begin(s_.link_counts), std::end(s_.link_counts), std::begin(n_.link));
}

std::int8_t HealthMaker::state() const {
  if (s_.stopping) return health_t::STOPPING;
  if (!s_.camera_there) return n_.chain.frames == 0 ? health_t::STARTING : health_t::NO_CAMERA;
  return n_.chain.has_tspi[0] && n_.chain.has_tspi[1] ? health_t::RUNNING : health_t::NO_NAV;
}

void HealthMaker::levels(std::int64_t now_ns) {
  const FrameFacts& f = s_.facts;
  const ChainCounts& c = n_.chain;
  const auto since = [&](std::int64_t then_ns) { return milliseconds(Duration{now_ns - std::max(then_ns, s_.started_ns)}); };
  out_.service_time_ns = now_ns;
  out_.state = state();
  out_.version = CYCLOPS_VERSION;
  out_.profile = s_.profile.name;
  out_.uptime_s = static_cast<float>(static_cast<double>(now_ns - s_.started_ns) * 1e-9);
  out_.frame_age_ms = since(s_.last_frame_host_ns);
  out_.measurement_age_ms = since(s_.last_published_ns);
  out_.frames_received = static_cast<std::int64_t>(n_.camera.received);
  out_.frames_incomplete = static_cast<std::int64_t>(n_.camera.incomplete);
  out_.frames_lost = static_cast<std::int64_t>(lost_frames(n_));
  out_.time_source = c.frames > 0 ? static_cast<std::int8_t>(f.time_source) : std::int8_t{-1};
  out_.time_sigma_us = microseconds(f.t_mid_sigma);
  const ClockState& clocks = c.clocks;
  out_.strobe_age_s = clocks.camera_sigma.ns > 0 ? static_cast<float>(clocks.camera_age.seconds()) : -1.0F;
  const bool any = clocks.t.ns != 0;   // a frame: sigma and age are at its time
  out_.gps_sigma_us = any && clocks.gps_source != GpsSource::kNone ? microseconds(clocks.gps_sigma) : -1.0F;
  out_.gps_age_s = any && clocks.gps_source == GpsSource::kTimeMark ? static_cast<float>(clocks.gps_age.seconds()) : -1.0F;
  out_.tspi_receiver_age_ms = c.has_tspi[0] ? milliseconds(f.t_mid - c.newest_tspi[0]) : -1.0F;
  out_.tspi_tanker_age_ms = c.has_tspi[1] ? milliseconds(f.t_mid - c.newest_tspi[1]) : -1.0F;
  out_.tspi_receiver_silence_ms = since(c.tspi_arrival[0].ns);
  out_.tspi_tanker_silence_ms = since(c.tspi_arrival[1].ns);
  out_.nav_contradicted = f.nav_suspect ? 1 : 0;
  out_.authenticated = s_.options.key ? 1 : 0;
  out_.range_m = static_cast<float>(f.range_m);
  out_.closure_mps = static_cast<float>(f.closure_mps);
  out_.features_visible = f.visible;
  out_.features_matched = f.matched;
  out_.tracks_live = f.live;
  out_.tracks_coasting = f.coasting;
  out_.tracks_dropped = static_cast<std::int64_t>(c.track.dropped);
  out_.residual_rms_px = static_cast<float>(f.residual_rms_px);
  out_.nis_mean = static_cast<float>(f.nis_mean);
  out_.integrity = static_cast<float>(f.integrity);
  out_.chain_us_p50 = microseconds(s_.chain_recent.quantile(0.5));
  out_.chain_us_p99 = microseconds(s_.chain_recent.quantile(0.99));
  out_.latency_ms_p50 = milliseconds(s_.latency_recent.quantile(0.5));
  out_.latency_ms_p99 = milliseconds(s_.latency_recent.quantile(0.99));
  out_.latency_ms_max = milliseconds(s_.latency_recent.max());
  n_.record = s_.recorder ? s_.recorder->counts() : RecordCounts{};
  out_.disk_left_min = n_.record.disk_left_min;
  const HostFacts& host = host_.look(now_ns);
  out_.load = static_cast<float>(host.load);
  out_.temperature_c = static_cast<float>(host.temperature_c);
  out_.cpu_percent = static_cast<float>(host.cpu_percent);
  out_.memory_mb = static_cast<float>(host.memory_mb);
  out_.open_files = host.open_files;
}

HealthMaker::Totals HealthMaker::totals(std::int64_t now_ns) const {
  const ChainCounts& c = n_.chain;
  return {now_ns, c.frames, lost_frames(n_), refused_messages(n_), c.stamp.edges, {c.tspi[0].accepted, c.tspi[1].accepted}, c.consensus};
}

void HealthMaker::rates(std::int64_t now_ns) {
  const Totals now = totals(now_ns);
  const Totals& old = kept_ > 0 ? past_[0] : now;
  const double window_s = static_cast<double>(now_ns - old.t_ns) * 1e-9;
  const auto rate = [&](std::uint64_t a, std::uint64_t b) { return window_s > 0 && a >= b ? static_cast<float>(static_cast<double>(a - b) / window_s) : 0.0F; };
  out_.frame_rate_hz = rate(now.frames, old.frames);
  out_.frames_lost_1s = static_cast<std::int32_t>(now.lost - old.lost);
  out_.strobe_rate_hz = rate(now.edges, old.edges);
  out_.tspi_receiver_rate_hz = rate(now.tspi[0], old.tspi[0]);
  out_.tspi_tanker_rate_hz = rate(now.tspi[1], old.tspi[1]);
  out_.refused_1s = static_cast<std::int32_t>(now.refused - old.refused);
  const std::uint64_t frames = now.frames - old.frames;
  out_.frame_rate_share = frames > 0 ? static_cast<float>(out_.frame_rate_hz / s_.rig.device.frame_rate_hz) : -1.0F;
  out_.consensus_share = frames > 0 ? static_cast<float>(now.consensus - old.consensus) / static_cast<float>(frames) : -1.0F;
  if (kept_ > 0 && now_ns - past_[kept_ - 1].t_ns < kEvery_ns) return;
  if (kept_ == kKept) std::copy(past_.begin() + 1, past_.end(), past_.begin());
  else ++kept_;
  past_[kept_ - 1] = now;
}

void HealthMaker::counters() {
  const ChainCounts& c = n_.chain;
  const CameraCounters& camera = n_.camera;
  out_.n_counters = 0;
  add(out_, "capture.complete", camera.received);
  add(out_, "capture.incomplete", camera.incomplete);
  add(out_, "capture.lost.gap", camera.lost_gap);
  add(out_, "capture.lost.leader", camera.lost_leader);
  add(out_, "capture.lost.no_buffer", camera.lost_no_buffer);
  add(out_, "capture.lost.size_mismatch", camera.lost_size_mismatch);
  add(out_, "capture.lost.rows_unknown", camera.lost_rows_unknown);
  add(out_, "capture.lost.frozen", camera.lost_frozen);
  add(out_, "capture.resent_packets", camera.packets.resent);
  add(out_, "capture.starts", camera.starts);
  add(out_, "service.queue_full", s_.inputs.refused());
  add(out_, "service.no_room", c.front_refused);
  add(out_, "service.room_flushed", c.room_flushed);
  add(out_, "time.edges", c.stamp.edges);
  add(out_, "time.edges_lost", c.stamp.edges_lost_seq + c.stamp.edges_lost_inferred);
  add(out_, "time.edges_spurious", c.stamp.edges_spurious);
  add(out_, "time.edges_doubled", c.stamp.edges_doubled);
  add(out_, "time.frames_without_edge", c.stamp.no_edge_lost + c.stamp.no_edge_waited + c.stamp.no_edge_beside);
  add(out_, "time.locks", c.stamp.lock_count);
  add(out_, "strobe.lost", n_.strobe.lost);
  add(out_, "strobe.disconnects", n_.strobe.disconnects);
  for (std::size_t l = 0; l < kLinks; ++l) {
    const std::string name = to_string(static_cast<Link>(l));
    const LinkCounts& link = n_.link[l];
    add(out_, name + ".received", link.received);
    add(out_, name + ".refused", link.refused);
    add(out_, name + ".flooded", link.flooded);
    add(out_, name + ".not_authentic", link.not_authentic);
    add(out_, name + ".replayed", link.replayed);
    if (l >= 2) continue;
    add(out_, name + ".guarded", link.guarded);
    add(out_, name + ".out_of_order", c.tspi[l].out_of_order_inserted);
    add(out_, name + ".duplicate", c.tspi[l].duplicate);
    add(out_, name + ".missing", c.tspi[l].missing);
  }
  add(out_, "nav.timed_out", c.aligner.timed_out);
  add(out_, "nav.without_nav", c.aligner.without_nav);
  add(out_, "chain.consensus", c.consensus);
  add(out_, "service.events_lost", s_.events.lost());
  if (n_.record.on) add_counters(out_, n_.record);
}

const clock_state_t& HealthMaker::clock() {
  clock_state_t& out = clock_;
  const ChainCounts& chain = n_.chain;
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
  out.pps_lost = static_cast<std::int64_t>(n_.pps.lost);
  out.strobe_locked = c.strobe_locked ? 1 : 0;
  out.camera_drift_ppm = c.camera_drift_ppm;
  out.camera_drift_sigma_ppm = c.camera_drift_sigma_ppm;
  out.camera_sigma_us = us(c.camera_sigma);
  out.camera_age_s = c.camera_age.seconds();
  out.edge_scatter_us = c.edge_scatter_us;
  out.lock_count = static_cast<std::int64_t>(chain.stamp.lock_count);
  return out;
}

static_assert(static_cast<std::int8_t>(GpsSource::kNone) == clock_state_t::NONE && static_cast<std::int8_t>(GpsSource::kArrival) == clock_state_t::ARRIVAL &&
              static_cast<std::int8_t>(GpsSource::kTimeMark) == clock_state_t::TIME_MARK);

}  // namespace cyclops
