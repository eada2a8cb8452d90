#pragma once
/// Hears what the service publishes on LCM. Only listens: nothing in the service knows of it.
///
/// Errors   open: the URL cannot be opened. Threads: one.
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <lcm/lcm.h>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace cyclops::tools {

/// So that a message that lies about a length costs an exception, not the machine's memory.
void limit_memory(std::size_t bytes);

class Listener {
 public:
  /// A message as it came; the bytes live during the call.
  using Taker = std::function<void(std::string_view channel, const void* data, std::size_t size)>;
  /// `url`: empty is LCM_DEFAULT_URL, else LCM's own default.
  static Result<std::unique_ptr<Listener>> open(const std::string& url, Taker taker);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  /// Waits for messages up to the timeout; true when at least one is there.
  bool wait(int timeout_ms);
  void handle();                     ///< those that are there, 500 at most

 private:
  Listener(lcm_t* lcm, Taker taker) : lcm_(lcm), taker_(std::move(taker)) {}
  static void on_message(const lcm_recv_buf_t* buffer, const char* channel, void* self);
  lcm_t* lcm_;
  Taker taker_;
};

}  // namespace cyclops::tools
