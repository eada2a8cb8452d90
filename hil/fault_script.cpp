#include "hil/fault_script.hpp"

#include <algorithm>
#include <array>

#include "base/config.hpp"

namespace cyclops::hil {
namespace {

const std::vector<std::string> kNone, kAircraft{"receiver", "tanker", "both"};

const std::array<FaultForm, kFaultKinds> kForms{{
    // name, amount: key, usual, low, high; share: key, usual; choice: key, options; text
    {"packet_loss", nullptr, 0, 0, 0, "share", 0.02, "resend", {"answered", "never"}, nullptr},
    {"packet_delay", "delay_ms", 10, 0, 1000, "share", 1, nullptr, kNone, nullptr},
    {"packet_reorder", nullptr, 0, 0, 0, nullptr, 1, nullptr, kNone, nullptr},
    {"packet_duplicate", nullptr, 0, 0, 0, nullptr, 1, nullptr, kNone, nullptr},
    {"frame_truncated", "keep", 0.5, 0.01, 0.99, "share", 1, nullptr, kNone, nullptr},
    {"frame_lost", nullptr, 0, 0, 0, "share", 0.1, nullptr, kNone, nullptr},
    {"frame_frozen", nullptr, 0, 0, 0, nullptr, 1, nullptr, kNone, nullptr},
    {"frame_rate", "every", 2, 2, 20, nullptr, 1, nullptr, kNone, nullptr},
    {"exposure", "factor", 0.5, 0.05, 8, nullptr, 1, nullptr, kNone, nullptr},
    {"camera_vanish", nullptr, 0, 0, 0, nullptr, 1, "outage", {"power", "cable"}, nullptr},
    {"strobe_lost", nullptr, 0, 0, 0, "share", 0.2, "where", {"wire", "buffer"}, nullptr},
    {"strobe_doubled", "after_us", 300, 1, 100'000, "share", 1, nullptr, kNone, nullptr},
    {"strobe_late", "late_us", 2000, 1, 1'000'000, "share", 0.3, nullptr, kNone, nullptr},
    {"strobe_held", "delay_ms", 60, 1, 5000, "share", 1, nullptr, kNone, nullptr},
    {"strobe_stuck", nullptr, 0, 0, 0, nullptr, 1, nullptr, kNone, nullptr},
    {"strobe_spurious", "rate_hz", 20, 0.1, 1000, nullptr, 1, nullptr, kNone, nullptr},
    {"camera_clock_step", "step_ms", 20, -10'000, 10'000, nullptr, 1, nullptr, kNone, nullptr},
    {"camera_clock_drift", "ppm", 50, -10'000, 10'000, nullptr, 1, nullptr, kNone, nullptr},
    {"gps_step", "step_ms", 100, -10'000, 10'000, nullptr, 1, nullptr, kNone, nullptr},
    {"gps_drift", "ppm", 50, -10'000, 10'000, nullptr, 1, nullptr, kNone, nullptr},
    {"pps_loss", nullptr, 0, 0, 0, nullptr, 1, nullptr, kNone, nullptr},
    {"tspi_loss", nullptr, 0, 0, 0, "share", 1, "aircraft", kAircraft, nullptr},
    {"tspi_delay", "delay_ms", 200, 0, 5000, "share", 1, "aircraft", kAircraft, nullptr},
    {"tspi_disorder", "most_ms", 120, 1, 5000, "share", 1, "aircraft", kAircraft, nullptr},
    {"tspi_duplicate", nullptr, 0, 0, 0, "share", 1, "aircraft", kAircraft, nullptr},
    {"tspi_bias", "east_m", 2, -1000, 1000, nullptr, 1, "aircraft", kAircraft, nullptr},
    {"tspi_freeze", nullptr, 0, 0, 0, nullptr, 1, "aircraft", kAircraft, nullptr},
    {"tspi_nan", nullptr, 0, 0, 0, "share", 1, "aircraft", kAircraft, nullptr},
    {"tspi_wrong_aircraft", nullptr, 0, 0, 0, "share", 1, "aircraft", kAircraft, nullptr},
    {"disk_slow", "stall_ms", 900, 10, 60'000, nullptr, 1, nullptr, kNone, "folder"},
    {"disk_full", nullptr, 0, 0, 0, nullptr, 1, nullptr, kNone, "folder"},
    {"disk_read_only", nullptr, 0, 0, 0, nullptr, 1, nullptr, kNone, "folder"},
    {"cpu_load", "threads", 2, 1, 64, "share", 0.8, "priority", {"normal", "high", "realtime"}, nullptr},
    {"flood", "rate_hz", 2000, 1, 100'000, nullptr, 1, "content", {"noise", "repeat", "large"}, "channel"},
}};

std::vector<std::string> names() {
  std::vector<std::string> out;
  for (const FaultForm& f : kForms) out.emplace_back(f.name);
  return out;
}

Fault read_fault(ConfigTable table) {
  Fault f;
  if (!table.has("kind")) table.fail("kind", "required key is missing");
  table.read_enum("kind", names(), f.kind);
  const FaultForm& form = form_of(f.kind);
  f.name = form.name;
  table.read("name", f.name);
  table.read_in("onset_s", 0.0, 1e7, f.onset_s);
  table.read_in("duration_s", 0.0, 1e7, f.duration_s);
  f.amount = form.usual;
  f.share = form.usual_share;
  if (form.amount != nullptr) table.read_in(form.amount, form.low, form.high, f.amount);
  if (form.share != nullptr) table.read_in(form.share, 0.0, 1.0, f.share);
  if (form.choice != nullptr) table.read_choice(form.choice, form.options, f.choice);
  if (form.text != nullptr) table.require(form.text, f.text);
  return f;
}

Result<FaultScript> read_script(Result<ConfigFile> file) {
  if (!file.ok()) return file.error();
  FaultScript script;
  ConfigTable root = file->root();
  root.read("seed", script.seed);
  for (ConfigTable& table : root.tables("fault")) script.faults.push_back(read_fault(table));
  CYCLOPS_TRY(file->finish());
  std::stable_sort(script.faults.begin(), script.faults.end(), [](const Fault& a, const Fault& b) { return a.onset_s < b.onset_s; });
  return script;
}

}  // namespace

const FaultForm& form_of(FaultKind kind) { return kForms[static_cast<std::size_t>(kind)]; }

Result<FaultScript> FaultScript::load(const std::string& path) { return read_script(ConfigFile::load(path)); }
Result<FaultScript> FaultScript::parse(const std::string& text, const std::string& name) { return read_script(ConfigFile::parse(text, name)); }

}  // namespace cyclops::hil
