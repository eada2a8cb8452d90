#include "base/log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace cyclops::log {
namespace {

spdlog::logger& logger() {
  static auto instance = [] {
    auto l = spdlog::stderr_color_mt("cyclops");
    l->set_pattern("%Y-%m-%d %H:%M:%S.%e %^%-5l%$ %v");
    return l;
  }();
  return *instance;
}

}  // namespace

void start(Level level) {
  constexpr spdlog::level::level_enum levels[] = {spdlog::level::debug, spdlog::level::info, spdlog::level::warn, spdlog::level::err};
  logger().set_level(levels[static_cast<int>(level)]);
}

void info(const char* category, const std::string& text) { logger().info("{:<9} {}", category, text); }
void warning(const char* category, const std::string& text) { logger().warn("{:<9} {}", category, text); }
void error(const char* category, const std::string& text) { logger().error("{:<9} {}", category, text); }

bool Throttle::pass(std::int64_t now_ns, std::uint64_t& held_back) {
  if (!first_ && now_ns - last_ns_ < period_ns_) {
    ++held_;
    return false;
  }
  first_ = false;
  last_ns_ = now_ns;
  held_back = held_;
  held_ = 0;
  return true;
}

}  // namespace cyclops::log
