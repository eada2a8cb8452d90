#include "tools/top_page.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace cyclops::tools {
namespace {

constexpr double kFoot = 0.3048;
constexpr int kLabel = 10;                 // columns of a row's name
const char* const kStates[] = {"STARTING", "RUNNING", "NO CAMERA", "NO TSPI", "STOPPING"};
const char* const kTimes[] = {"strobe", "camera clock", "arrival", "UNKNOWN"};
const char* const kGpsSources[] = {"UNKNOWN", "arrival of TSPI", "marks"};
const char* const kLevels[] = {"info", "WARNING", "FAULT", "recovery", "mark"};
const char* const kReasons[] = {"ok", "none", "other", "hidden", "far", "lone"};

template <class... Args>
std::string printed(const char* format, Args... args) {
  char buffer[320];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

template <std::size_t N>
const char* named(const char* const (&names)[N], int i) {
  return i >= 0 && static_cast<std::size_t>(i) < N ? names[i] : "?";
}

std::string span_of(double s) {
  const auto t = static_cast<long>(s);
  return s < 60 ? printed("%.1f s", s) : s < 3600 ? printed("%ld:%02ld", t / 60, t % 60) : printed("%ld:%02ld:%02ld", t / 3600, t / 60 % 60, t % 60);
}

/// What another program sent may hold anything; a terminal must not see its control characters.
std::string printable(std::string s) {
  std::replace_if(s.begin(), s.end(), [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return s;
}

Style style_of(int level) { return level == event_t::FAULT ? Style::kFault : level == event_t::WARNING ? Style::kWarning : level == event_t::RECOVERY ? Style::kGood : Style::kPlain; }

class Writer {
 public:
  Writer(const Board& board, int columns, int rows, std::int64_t now_ns) : board_(board), now_ns_(now_ns), stale_(board.stale(now_ns)) {
    page_.columns = columns;
    page_.rows = rows;
  }

  Page page() {
    title();
    alarms();
    if (board_.health()) {
      const health_t& h = *board_.health();
      camera(h);
      time(h);
      clock(h);
      tspi("TSPI rec", "tspi.receiver.", "tspi_receiver_silence_ms", h.tspi_receiver_silence_ms, h.tspi_receiver_age_ms, h.tspi_receiver_rate_hz);
      tspi("TSPI tan", "tspi.tanker.", "tspi_tanker_silence_ms", h.tspi_tanker_silence_ms, h.tspi_tanker_age_ms, h.tspi_tanker_rate_hz);
      link(h);
      picture(h);
      host(h);
      if (page_.rows - row_ >= 18) features();
      if (page_.rows - row_ >= 14) strips();
    }
    events();
    put(page_.rows - 1, 0, Style::kDim, "q quit   values: yellow warning, red fault, dim stale");
    return std::move(page_);
  }

 private:
  void put(int row, int column, Style style, std::string text) {
    if (row >= page_.rows || column >= page_.columns) return;
    text.resize(std::min(text.size(), static_cast<std::size_t>(page_.columns - column)));
    page_.spans.push_back({row, column, style, std::move(text)});
  }
  void begin(const char* name) {
    put(row_, 0, Style::kDim, name);
    column_ = kLabel;
  }
  void end() { ++row_; }
  /// One value and its words; styled by the alarm on `quantity`.
  void value(const std::string& text, const char* quantity = nullptr, Style style = Style::kPlain) {
    const alarm_t* alarm = quantity != nullptr ? board_.alarm_on(quantity) : nullptr;
    if (alarm != nullptr) style = style_of(alarm->level);
    put(row_, column_, stale_ ? Style::kDim : style, text);
    column_ += static_cast<int>(text.size()) + 2;
  }
  void count(const char* words, std::int64_t n) { value(printed("%s %lld", words, static_cast<long long>(n)), nullptr, n > 0 ? Style::kWarning : Style::kPlain); }

  void title() {
    std::string bar(static_cast<std::size_t>(page_.columns), ' ');
    put(0, 0, stale_ ? Style::kFault : Style::kTitle, bar);
    const double age = board_.health_age_s(now_ns_);
    std::string left = " CYCLOPS ";
    if (board_.health()) {
      const health_t& h = *board_.health();
      left += printed("%s  %s  up %s  profile %s", printable(h.version).c_str(), named(kStates, h.state), span_of(h.uptime_s).c_str(), printable(h.profile).c_str());
    }
    const std::string right = stale_ ? printed("STALE: no HEALTH for %s ", span_of(age).c_str()) : printed("HEALTH %.1f s old%s ", age, board_.health_lost() > 0 ? printed(", %lld lost", static_cast<long long>(board_.health_lost())).c_str() : "");
    const Style style = stale_ ? Style::kFault : Style::kTitle;
    put(0, 0, style, left);
    put(0, std::max(0, page_.columns - static_cast<int>(right.size())), style, right);
  }

  void alarms() {
    row_ = 1;
    if (!board_.health()) return;
    const health_t& h = *board_.health();
    if (h.alarms.empty()) put(row_++, 0, stale_ ? Style::kDim : Style::kGood, "no alarm");
    const std::size_t most = page_.rows < 30 ? 5 : 10;
    for (std::size_t i = 0; i < h.alarms.size(); ++i) {
      if (i + 1 == most && h.alarms.size() > most) {
        put(row_++, 0, Style::kFault, printed("and %zu more", h.alarms.size() - i));
        break;
      }
      const alarm_t& a = h.alarms[i];
      const double since_s = static_cast<double>(h.service_time_ns - a.since_ns) * 1e-9;
      put(row_++, 0, style_of(a.level),
          printed("%-7s %s  (%.4g%s, limit %.4g)  since %s", named(kLevels, a.level), printable(a.text).c_str(), a.value, a.unit.empty() ? "" : printable(" " + a.unit).c_str(), a.limit, span_of(since_s).c_str()));
    }
  }

  void camera(const health_t& h) {
    begin("CAMERA");
    value(printed("%.1f Hz", h.frame_rate_hz), "frame_rate_share");
    value(printed("newest %s ago", span_of(h.frame_age_ms * 1e-3).c_str()), "frame_age_ms");
    value(printed("complete %lld", static_cast<long long>(h.frames_received)));
    count("incomplete", h.frames_incomplete);
    value(printed("lost %lld", static_cast<long long>(h.frames_lost)), "frames_lost_1s", h.frames_lost > 0 ? Style::kWarning : Style::kPlain);
    end();
    begin("  lost by");
    for (const auto& [words, name] : {std::pair{"gap", "capture.lost.gap"}, {"leader", "capture.lost.leader"}, {"buffer", "capture.lost.no_buffer"}, {"size", "capture.lost.size_mismatch"},
                                      {"rows", "capture.lost.rows_unknown"}, {"room", "service.no_room"}, {"queue", "service.queue_full"}})
      count(words, board_.counter(name));
    end();
  }

  void time(const health_t& h) {
    begin("TIME");
    value(named(kTimes, h.time_source), "time_source");
    value(printed("sigma %.0f us", h.time_sigma_us), "time_sigma_us");
    value(printed("strobe %.1f Hz", h.strobe_rate_hz), "strobe_rate_hz");
    count("edges lost", board_.counter("time.edges_lost"));
    count("spurious", board_.counter("time.edges_spurious"));
    value(printed("locks %lld", static_cast<long long>(board_.counter("time.locks"))));
    end();
  }

  /// GPS time, then what is known of the two clocks' rates.
  void clock(const health_t& h) {
    begin("CLOCK");
    const clock_state_t* c = board_.clock() ? &*board_.clock() : nullptr;
    const bool marks = h.gps_age_s >= 0, known = h.gps_sigma_us >= 0;
    value(printed("GPS by %s", kGpsSources[marks ? 2 : known ? 1 : 0]), nullptr, known ? Style::kPlain : Style::kWarning);
    if (known) value(printed("sigma %.0f us", h.gps_sigma_us), "gps_sigma_us");
    if (marks) value(printed("mark %s ago", span_of(h.gps_age_s).c_str()), "gps_age_s");
    if (h.strobe_age_s >= 0) value(printed("edge %s ago", span_of(h.strobe_age_s).c_str()), "strobe_age_s");
    if (c != nullptr && page_.columns >= 110) {
      value(printed("drift %+.2f ppm", c->gps_drift_ppm));
      value(printed("camera %+.2f ppm, scatter %.0f us", c->camera_drift_ppm, c->edge_scatter_us));
    }
    end();
  }

  void tspi(const char* name, const std::string& prefix, const char* quantity, double silence_ms, double age_ms, double rate_hz) {
    begin(name);
    value(printed("%5.1f Hz", rate_hz));
    value(printed("heard %s ago", span_of(silence_ms * 1e-3).c_str()), quantity);
    value(age_ms == -1 ? "never used" : printed("%.0f ms %s frame", std::fabs(age_ms), age_ms > 0 ? "before" : "after"));
    for (const char* cause : {"missing", "refused", "guarded", "flooded"})
      if (const std::int64_t n = board_.counter(prefix + cause); n > 0 || page_.columns >= 110) count(cause, n);
    end();
  }

  void link(const health_t& h) {
    begin("LINK");
    value(h.authenticated ? "tags required" : "no tags");
    value(printed("refused in 1 s: %d", h.refused_1s), "refused_1s");
    std::int64_t fakes = 0, replays = 0;
    for (const char* name : {"tspi.receiver", "tspi.tanker", "time_mark", "mark"}) {
      fakes += board_.counter(std::string(name) + ".not_authentic");
      replays += board_.counter(std::string(name) + ".replayed");
    }
    count("not authentic", fakes);
    count("replayed", replays);
    value(printed("time marks %lld", static_cast<long long>(board_.counter("time_mark.received"))));
    end();
  }

  void picture(const health_t& h) {
    begin("TANKER");
    value(h.range_m < 0 ? "range unknown" : printed("range %.1f m (%.0f ft)  closure %+.2f m/s (%+.1f ft/s)", h.range_m, h.range_m / kFoot, h.closure_mps, h.closure_mps / kFoot), "range_m");
    value(h.nav_contradicted ? "TSPI CONTRADICTS PICTURE" : "TSPI agrees", "nav_contradicted");
    end();
    begin("FEATURES");
    value(printed("visible %d", h.features_visible));
    value(printed("matched %d", h.features_matched));
    value(printed("live %d  coasting %d", h.tracks_live, h.tracks_coasting));
    value(h.consensus_share < 0 ? "agree in -" : printed("agree in %.0f %%", 100 * h.consensus_share), "consensus_share");
    value(printed("dropped %lld", static_cast<long long>(h.tracks_dropped)));
    end();
    begin("QUALITY");
    value(printed("residual %.2f px", h.residual_rms_px), "residual_rms_px");
    value(printed("NIS %.1f", h.nis_mean), "nis_mean");
    value(printed("integrity %.2f", h.integrity), "integrity");
    value(printed("newest measurement %s ago", span_of(h.measurement_age_ms * 1e-3).c_str()), "measurement_age_ms");
    end();
    begin("LATENCY");
    value(printed("p50 %.1f  p99 %.1f  max %.1f ms", h.latency_ms_p50, h.latency_ms_p99, h.latency_ms_max), "latency_ms_p99");
    value(printed("chain p50 %.1f p99 %.1f ms", h.chain_us_p50 * 1e-3, h.chain_us_p99 * 1e-3), "chain_us_p99");
    end();
  }

  void host(const health_t& h) {
    begin("HOST");
    value(printed("load %.1f", h.load), "load");
    value(printed("service %.0f %%", h.cpu_percent), "cpu_percent");
    value(printed("%.0f MB  %d files", h.memory_mb, h.open_files), "memory_mb");
    value(h.temperature_c < 0 ? "temperature -" : printed("%.0f C", h.temperature_c), "temperature_c");
    value(h.disk_left_min < 0 ? "not recording" : printed("disk %.0f min", h.disk_left_min), "disk_left_min");
    end();
  }

  /// Every feature looked for: id, and its innovation or why there is none.
  void features() {
    const measurement_set_t& m = board_.newest().measurement;
    if (board_.newest().seq < 0) return;
    ++row_;
    put(row_++, 0, Style::kDim, printed("FEATURES of frame %lld: innovation in px, or why not", static_cast<long long>(m.seq)));
    const int width = 13, across = std::max(1, page_.columns / width);
    for (std::size_t i = 0; i < m.items.size(); ++i) {
      const measurement_t& item = m.items[i];
      const std::string text = item.accepted ? printed("%3d %6.2f", item.id, std::hypot(item.innovation_px[0], item.innovation_px[1])) : printed("%3d %6s", item.id, named(kReasons, item.reason));
      put(row_ + static_cast<int>(i) / across, static_cast<int>(i) % across * width, stale_ || !item.accepted ? Style::kDim : Style::kPlain, text);
    }
    row_ += (static_cast<int>(m.items.size()) + across - 1) / across;
  }

  /// The last minutes as rows of levels 0 to 9, oldest left; each its own scale.
  void strips() {
    ++row_;
    put(row_++, 0, Style::kDim, "LAST MINUTE (one column = 1 s; digits: tenths of the row's own span, '.' none)");
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    strip("range m", [](const Sample& s) { return s.range_m < 0 ? kNone : s.range_m; });
    strip("closure", [](const Sample& s) { return s.range_m < 0 ? kNone : s.closure_mps; });
    strip("matched", [](const Sample& s) { return static_cast<float>(s.matched); });
    strip("resid px", [](const Sample& s) { return s.matched > 0 ? s.residual_px : kNone; });
    strip("late ms", [](const Sample& s) { return s.latency_p99_ms; });
  }
  template <class Get>
  void strip(const char* name, Get get) {
    constexpr int kSeconds = 60;
    double sum[kSeconds] = {};
    int n[kSeconds] = {};
    for (const Sample& s : board_.samples()) {
      const auto ago = (now_ns_ - s.t_ns) / 1'000'000'000;
      const auto v = static_cast<double>(get(s));
      if (ago < 0 || ago >= kSeconds || std::isnan(v)) continue;
      sum[kSeconds - 1 - ago] += v;
      ++n[kSeconds - 1 - ago];
    }
    double low = 1e30, high = -1e30;
    for (int i = 0; i < kSeconds; ++i)
      if (n[i] > 0) low = std::min(low, sum[i] / n[i]), high = std::max(high, sum[i] / n[i]);
    std::string line(kSeconds, '.');
    for (int i = 0; i < kSeconds; ++i)
      if (n[i] > 0) line[static_cast<std::size_t>(i)] = static_cast<char>('0' + (high > low ? static_cast<int>(9.99 * (sum[i] / n[i] - low) / (high - low)) : 0));
    begin(name);
    value(line);
    if (low <= high) value(printed("%.3g to %.3g", low, high));
    end();
  }

  void events() {
    const int first = row_, last = page_.rows - 2;
    if (first >= last) return;
    put(first, 0, Style::kDim, "EVENTS, newest first");
    int row = first + 1;
    for (auto e = board_.events().rbegin(); e != board_.events().rend() && row <= last; ++e, ++row) {
      const double ago = static_cast<double>(now_ns_ - e->t_ns) * 1e-9;
      put(row, 0, Style::kDim, printed("%8s ago", span_of(ago).c_str()));
      put(row, 13, style_of(e->event.level), named(kLevels, e->event.level));
      put(row, 22, Style::kPlain, printed("%s %s: %s", printable(e->event.source).c_str(), printable(e->event.code).c_str(), printable(e->event.text).c_str()));
    }
  }

  const Board& board_;
  std::int64_t now_ns_;
  bool stale_;
  Page page_;
  int row_{0};
  int column_{0};
};

}  // namespace

Page top_page(const Board& board, int columns, int rows, std::int64_t now_ns) { return Writer(board, columns, rows, now_ns).page(); }

std::string Page::text() const {
  std::vector<std::string> lines(static_cast<std::size_t>(rows), std::string(static_cast<std::size_t>(columns), ' '));
  for (const Span& s : spans) lines[static_cast<std::size_t>(s.row)].replace(static_cast<std::size_t>(s.column), s.text.size(), s.text);
  std::string out;
  for (std::string& line : lines) out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  return out;
}

}  // namespace cyclops::tools
