#pragma once
/// What the web page is told, as JSON made once for all viewers.
///
/// Threads  put() from the thread that listens, all else from any. Viewers wait for what is newer than what they have and get
///          the newest only: a slow one misses messages, it never holds anyone up and nothing is queued for it.
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>

#include "tools/board.hpp"

namespace cyclops::tools {

class WebFeed {
 public:
  using Text = std::shared_ptr<const std::string>;
  struct News {
    std::uint64_t health_number{0};
    std::uint64_t frame_number{0};
    Text health{};                   ///< null: nothing newer
    Text frame{};
    bool stopped{false};
  };

  /// One LCM message.
  void put(std::string_view channel, const void* data, std::size_t size, std::int64_t now_ns);
  /// What is newer than these numbers; waits for it for up to `timeout_ms`.
  [[nodiscard]] News wait(std::uint64_t health_number, std::uint64_t frame_number, int timeout_ms);
  /// Samples for the strip charts: {"age_s": [...], "range_m": [...], ...}, oldest first.
  [[nodiscard]] std::string history(std::int64_t now_ns) const;
  /// Newest HEALTH and its age.
  [[nodiscard]] std::string health(std::int64_t now_ns) const;
  void stop();

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Board board_;
  std::uint64_t health_number_{0}, frame_number_{0};
  std::int64_t last_health_ns_{0};
  std::int64_t last_thumbnail_{-1};
  Text health_, frame_;
  bool stopped_{false};
};

/// For tests and scripts: the same texts from a board.
[[nodiscard]] std::string health_json(const Board& board, std::int64_t now_ns);
[[nodiscard]] std::string frame_json(const Picture& picture);

}  // namespace cyclops::tools
