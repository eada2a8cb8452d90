#pragma once
/// From any thread to whoever publishes: what an engineer should know. Bounded; what finds no room is counted.
#include <array>
#include <cstdint>
#include <cstdio>
#include <string>

#include "base/bounded_queue.hpp"
#include "wire/messages.hpp"

namespace cyclops {

struct EventRecord {
  Time t{};
  EventLevel level{EventLevel::kInfo};
  std::array<char, 24> source{};
  std::array<char, 40> code{};
  std::array<char, 240> text{};
  std::int64_t count{1};
};

class EventBus {
 public:
  EventBus() : queue_(256) {}
  void post(Time t, EventLevel level, const char* source, const char* code, const std::string& text, std::int64_t count = 1) {
    EventRecord e;
    e.t = t;
    e.level = level;
    e.count = count;
    std::snprintf(e.source.data(), e.source.size(), "%s", source);
    std::snprintf(e.code.data(), e.code.size(), "%s", code);
    std::snprintf(e.text.data(), e.text.size(), "%s", text.c_str());
    (void)queue_.try_push(std::move(e));
  }
  [[nodiscard]] std::optional<EventRecord> next() { return queue_.try_pop(); }
  [[nodiscard]] std::uint64_t lost() const { return queue_.refused(); }

 private:
  BoundedQueue<EventRecord> queue_;
};

}  // namespace cyclops
