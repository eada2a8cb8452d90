#include "monitor/limits.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <limits>

#include "base/config.hpp"
#include "base/file.hpp"

// The file itself becomes part of the program, so that the two cannot differ.
__asm__(
    ".section .rodata\n"
    "cyclops_alarms_begin:\n"
    ".incbin \"config/alarms.toml\"\n"
    "cyclops_alarms_end:\n"
    ".previous\n");
extern "C" {
extern const char cyclops_alarms_begin[];
extern const char cyclops_alarms_end[];
}

namespace cyclops {
namespace {

constexpr double kMostHold_ms = 600'000;
constexpr double kFar = 1e12;

bool good_name(const std::string& name) {
  return !name.empty() && name.size() <= 32 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '.' || c == '_'; });
}

void read_quantity(ConfigTable& t, Limit& out) {
  std::string name, unit;
  t.require("quantity", name);
  t.require("unit", unit);
  out.quantity = find_quantity(name);
  if (out.quantity == nullptr) t.fail("quantity", "is \"" + name + "\", expected a number of HEALTH (docs/monitoring.md)");
  else if (unit != out.quantity->unit) t.fail("unit", "is \"" + unit + "\", expected \"" + out.quantity->unit + "\" for " + name);
}

void read_limit(ConfigTable& t, Limit& out) {
  out.above = t.has("above");
  if (out.above == t.has("below")) t.fail(out.above ? "below" : "above", "expected either above or below");
  t.read_in(out.above ? "above" : "below", -kFar, kFar, out.limit);
  out.clear = out.limit;
  t.read_in("clear", -kFar, kFar, out.clear);
  if (out.above ? out.clear > out.limit : out.clear < out.limit) t.fail("clear", "lies beyond the limit, expected within it");
  double hold_ms = 0, clear_hold_ms = 0;
  t.read_in("hold_ms", 0.0, kMostHold_ms, hold_ms);
  t.read_in("clear_hold_ms", 0.0, kMostHold_ms, clear_hold_ms);
  out.hold = Duration::from_ms(hold_ms);
  out.clear_hold = Duration::from_ms(clear_hold_ms);
}

Result<Limits> read(const ConfigFile& file) {
  Limits out;
  out.name = std::filesystem::path(file.name()).filename().string();
  for (ConfigTable& t : file.root().tables("alarm")) {
    Limit limit;
    t.require("name", limit.name);
    t.require("text", limit.text);
    if (!good_name(limit.name)) t.fail("name", "is \"" + limit.name + "\", expected up to 32 letters, digits, dots and underscores");
    if (limit.text.empty() || limit.text.size() > 80) t.fail("text", "expected 1 to 80 characters");
    if (!t.has("level")) t.fail("level", "required key is missing");
    int level = 0;
    t.read_choice("level", {"warning", "fault"}, level);
    limit.level = level == 0 ? AlarmLevel::kWarning : AlarmLevel::kFault;
    read_quantity(t, limit);
    read_limit(t, limit);
    if (std::any_of(out.items.begin(), out.items.end(), [&](const Limit& other) { return other.name == limit.name; }))
      t.fail("name", "is \"" + limit.name + "\", which another alarm has already");
    out.items.push_back(std::move(limit));
  }
  CYCLOPS_TRY(file.finish());
  return out;
}

}  // namespace

Result<Limits> Limits::parse(const std::string& text, const std::string& name) {
  auto file = ConfigFile::parse(text, name);
  if (!file.ok()) return file.error();
  return read(*file);
}

Result<Limits> Limits::load(const std::string& path) {
  auto text = read_file(path);
  if (!text.ok()) return text.error();
  return parse(*text, path);
}

Limits Limits::built_in() {
  auto limits = parse({cyclops_alarms_begin, cyclops_alarms_end}, "built-in");
  CYCLOPS_ASSERT(limits.ok());
  return std::move(limits).value();
}

}  // namespace cyclops
