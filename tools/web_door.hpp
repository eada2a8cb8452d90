#pragma once
/// An HTTP server that gives a thread to a connection only when its whole request is there.
///
/// cpp-httplib gives one from the start, so that a program which opens as many connections as there are threads, and says nothing or one
/// byte a second, keeps everyone else out. Here connections without a whole request cost no thread: they wait in one place, kWaiting at
/// most, each for kPatience_s at most; where there is no room the one that has waited longest goes.
/// One request a connection. Answers of up to kAnswer bytes go into the socket's buffer: a reader that takes none holds no thread either.
/// Threads  one that accepts (httplib's), one that waits, `threads` that answer.
#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include "tools/http.hpp"

namespace cyclops::tools {

class WebDoor : public httplib::Server {
 public:
  static constexpr std::size_t kWaiting = 64;
  static constexpr std::size_t kHead = 8192;         ///< a request is shorter; longer ones are closed without an answer
  static constexpr int kAnswer = 128 << 10;
  static constexpr int kPatience_s = 2;
  static constexpr int kQueued = 64;                 ///< whole requests that wait for a thread; beyond them connections are closed

  explicit WebDoor(std::size_t threads);
  ~WebDoor() override;
  /// After binding: the library lets only five connections wait to be accepted; more would be put off by a second each.
  void queue_more() { (void)::listen(svr_sock_, SOMAXCONN); }
  /// After stop() and the end of listen_after_bind(): ends all threads and connections.
  void close();

 private:
  struct Waiting {
    int fd;
    std::int64_t until_ns;
  };
  enum class Head { kWhole, kPart, kGone };

  bool process_and_close_socket(socket_t fd) override;
  [[nodiscard]] static Head look(int fd);
  void dispatch(int fd);
  void serve(int fd);
  void watch();
  void wake() const;

  httplib::ThreadPool pool_;
  std::atomic<int> queued_{0};
  std::mutex mutex_;
  std::vector<Waiting> waiting_;                     // longest first
  int wake_;
  bool closing_{false};
  std::thread watcher_;
};

}  // namespace cyclops::tools
