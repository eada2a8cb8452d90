#pragma once
/// Words for people: start, stop, fault and recovery, one category a stage, throttled. Numbers go to HEALTH, not here.
///
/// Threads: any. Never called per frame on the hot path. Backed by spdlog, to stderr.
#include <cstdint>
#include <memory>
#include <string>

namespace cyclops::log {

enum class Level { kDebug, kInfo, kWarning, kError };

void start(Level level);                                   ///< once, before the first word
void info(const char* category, const std::string& text);
void warning(const char* category, const std::string& text);
void error(const char* category, const std::string& text);

/// Lets the first of a kind through, then at most one each `period_s`; counts the ones held back.
class Throttle {
 public:
  explicit Throttle(double period_s = 5.0) : period_ns_(static_cast<std::int64_t>(period_s * 1e9)) {}
  /// True when the caller may speak now; `held_back` then says how many were silent since.
  bool pass(std::int64_t now_ns, std::uint64_t& held_back);

 private:
  std::int64_t period_ns_;
  std::int64_t last_ns_{0};
  bool first_{true};
  std::uint64_t held_{0};
};

}  // namespace cyclops::log
