#pragma once
/// Listens on LCM and puts everything into a Board. Only listens: nothing in the service knows of it.
///
/// Errors   open: the URL cannot be opened. Threads: one; who shares the board locks it around step().
#include <memory>
#include <string>

#include <lcm/lcm.h>

#include "base/result.hpp"
#include "tools/board.hpp"

namespace cyclops::tools {

[[nodiscard]] std::int64_t steady_now_ns();
/// So that a message that lies about a length costs an exception, not the machine's memory.
void limit_memory(std::size_t bytes);

class Listener {
 public:
  /// `url`: empty is LCM_DEFAULT_URL, else LCM's own default.
  static Result<std::unique_ptr<Listener>> open(const std::string& url);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  /// Waits for messages up to the timeout; true when at least one came. Only the wait is without touching the board.
  bool wait(int timeout_ms);
  void handle(Board& board);         ///< those that are there

 private:
  explicit Listener(lcm_t* lcm) : lcm_(lcm) {}
  static void on_message(const lcm_recv_buf_t* buffer, const char* channel, void* self);
  lcm_t* lcm_;
  Board* board_{nullptr};
};

}  // namespace cyclops::tools
