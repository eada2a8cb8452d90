#pragma once
/// Limits from a file (config/alarms.toml): what is watched, how far it may go, and how long beyond before it counts.
///
///   [[alarm]]
///   name = "camera.silent"        constant, for filters; letters, digits, '.', '_'
///   text = "camera is silent"     for people
///   level = "fault"               warning or fault
///   quantity = "frame_age_ms"     a field of HEALTH (monitor/quantity.hpp)
///   unit = "ms"                   must be the quantity's
///   above = 150                   or below = ...; the alarm is on beyond it
///   clear = 100                   off when back within this; left out: the limit itself
///   hold_ms = 0                   so long beyond before it is on
///   clear_hold_ms = 1000          so long back before it is off
///
/// Errors   unknown or missing keys, an unknown quantity, another unit, two alarms of one name, `clear` on the wrong side:
///          with file and line.
#include <string>
#include <vector>

#include "base/result.hpp"
#include "base/time.hpp"
#include "monitor/quantity.hpp"

namespace cyclops {

enum class AlarmLevel : std::uint8_t { kWarning = 1, kFault = 2 };   ///< numbers of alarm_t

struct Limit {
  std::string name;
  std::string text;
  AlarmLevel level{AlarmLevel::kWarning};
  const Quantity* quantity{nullptr};
  bool above{true};                 ///< false: the alarm is on below the limit
  double limit{0};
  double clear{0};
  Duration hold{};
  Duration clear_hold{};
};

struct Limits {
  std::string name{"built-in"};     ///< of the file
  std::vector<Limit> items;
  static Result<Limits> load(const std::string& path);
  static Result<Limits> parse(const std::string& text, const std::string& name);
  /// config/alarms.toml as it was when the program was built.
  static Limits built_in();
};

}  // namespace cyclops
