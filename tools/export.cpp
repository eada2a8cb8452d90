#include "tools/export.hpp"

#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>

#include <cyclops/health_t.hpp>
#include <cyclops/measurement_set_t.hpp>
#include <cyclops/nav_state_t.hpp>

#include "record/flight.hpp"
#include "record/sortie.hpp"
#include "tools/export_pictures.hpp"
#include "tools/offline.hpp"
#include "wire/codec.hpp"

namespace cyclops::tools {
namespace fs = std::filesystem;
namespace {

using record::LogEvent;
using ll = long long;

Result<> each(const std::vector<std::string>& logs, const std::function<Result<>(const LogEvent&)>& see) {
  LogEvent e;
  for (const std::string& path : logs) {
    auto log = record::EventLog::open(path);
    if (!log.ok()) return log.error();
    while (true) {
      auto more = log->next(e);
      if (!more.ok()) return more.error();
      if (!*more) break;
      CYCLOPS_TRY(see(e));
    }
  }
  return Ok{};
}

class Table {
 public:
  static Result<Table> create(const std::string& path) {
    Table t;
    t.path_ = path;
    t.file_.reset(std::fopen(path.c_str(), "w"));
    if (!t.file_) return make_error(ErrorCode::kIo, path, "cannot be written");
    return t;
  }
  std::FILE* get() { return file_.get(); }
  Result<> close() {
    const bool good = std::ferror(file_.get()) == 0 && std::fflush(file_.get()) == 0;
    if (!good) return make_error(ErrorCode::kIo, path_, "cannot be written whole");
    return Ok{};
  }

 private:
  struct Close { void operator()(std::FILE* f) const { std::fclose(f); } };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
};

template <class Message, class Row>
Result<std::int64_t> table(const std::vector<std::string>& logs, const char* channel, const std::string& path, const char* head, Row row) {
  auto out = Table::create(path);
  if (!out.ok()) return out.error();
  if (head != nullptr) std::fprintf(out->get(), "%s\n", head);
  std::int64_t rows = 0;
  Message m;
  CYCLOPS_TRY(each(logs, [&](const LogEvent& e) -> Result<> {
    if (e.channel == channel && m.decode(e.data.data(), 0, static_cast<int>(e.data.size())) >= 0) row(out->get(), m, rows++ == 0);
    return Ok{};
  }));
  CYCLOPS_TRY(out->close());
  return rows;
}

void nav_row(std::FILE* f, const nav_state_t& m, bool) {
  std::fprintf(f, "%lld,%lld,%d,%d,%d,%d,%lld,%lld,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g", static_cast<ll>(m.seq), static_cast<ll>(m.mid_exposure_ns), m.valid, m.used, m.extrapolated, m.absence,
               static_cast<ll>(m.age_receiver_ns), static_cast<ll>(m.age_tanker_ns), m.t_r_k_m[0], m.t_r_k_m[1], m.t_r_k_m[2], m.q_r_k[0], m.q_r_k[1], m.q_r_k[2], m.q_r_k[3]);
  for (int i = 0; i < 6; ++i) std::fprintf(f, ",%.9g", m.covariance[7 * i]);
  std::fputc('\n', f);
}

void health_row(std::FILE* f, const health_t& m, bool first) {
  if (first) {
    std::fprintf(f, "service_time_ns,state,uptime_s,frame_rate_hz,frames_received,frames_incomplete,frames_lost,time_source,time_sigma_us,tspi_receiver_age_ms,tspi_tanker_age_ms,range_m,"
                    "closure_mps,features_visible,features_matched,tracks_live,residual_rms_px,integrity,chain_us_p99,latency_ms_p99,disk_left_min,load,temperature_c");
    for (const auto& c : m.counters) std::fprintf(f, ",%s", c.name.c_str());
    std::fputc('\n', f);
  }
  std::fprintf(f, "%lld,%d,%g,%g,%lld,%lld,%lld,%d,%g,%g,%g,%g,%g,%d,%d,%d,%g,%g,%g,%g,%g,%g,%g", static_cast<ll>(m.service_time_ns), m.state, static_cast<double>(m.uptime_s),
               static_cast<double>(m.frame_rate_hz), static_cast<ll>(m.frames_received), static_cast<ll>(m.frames_incomplete), static_cast<ll>(m.frames_lost), m.time_source,
               static_cast<double>(m.time_sigma_us), static_cast<double>(m.tspi_receiver_age_ms), static_cast<double>(m.tspi_tanker_age_ms), static_cast<double>(m.range_m),
               static_cast<double>(m.closure_mps), m.features_visible, m.features_matched, m.tracks_live, static_cast<double>(m.residual_rms_px), static_cast<double>(m.integrity),
               static_cast<double>(m.chain_us_p99), static_cast<double>(m.latency_ms_p99), static_cast<double>(m.disk_left_min), static_cast<double>(m.load), static_cast<double>(m.temperature_c));
  for (const auto& c : m.counters) std::fprintf(f, ",%lld", static_cast<ll>(c.value));
  std::fputc('\n', f);
}

template <class T>
Result<> into(Result<T> result, std::int64_t& out) {
  if (!result.ok()) return result.error();
  out = *result;
  return Ok{};
}

}  // namespace

Result<Exported> export_all(const ExportOptions& options) {
  ExportOptions o = options;
  if (o.logs.empty()) o.logs = log_parts(o.folder, record::kPublished);
  const bool tables = !o.measurements.empty() || !o.nav.empty() || !o.health.empty();
  if (tables && o.logs.empty()) return make_error(ErrorCode::kNotFound, o.folder, "holds no published.lcm; give a log with --log (cyclops-offline makes one)");
  Exported out;
  if (!o.measurements.empty())
    CYCLOPS_TRY(into(measurements_csv(o.logs, o.measurements), out.measurements));
  if (!o.nav.empty())
    CYCLOPS_TRY(into(table<nav_state_t>(o.logs, channel::kNav, o.nav,
                                        "frame,mid_exposure_ns,valid,used,extrapolated,absence,age_receiver_ns,age_tanker_ns,x_m,y_m,z_m,qw,qx,qy,qz,var_rx_rad2,var_ry_rad2,var_rz_rad2,var_x_m2,var_y_m2,var_z_m2", nav_row),
                     out.nav));
  if (!o.health.empty()) CYCLOPS_TRY(into(table<health_t>(o.logs, channel::kHealth, o.health, nullptr, health_row), out.health));
  if (o.frames.empty() && o.pictures.empty() && o.video.empty()) return out;
  auto drawn = export_pictures(o);
  if (!drawn.ok()) return drawn.error();
  out.frames = drawn->frames;
  out.pictures = drawn->pictures;
  return out;
}

}  // namespace cyclops::tools
