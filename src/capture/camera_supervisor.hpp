#pragma once
/// Closes streams and opens new ones on a thread of its own, because both block for seconds; while one lives, reads its settings
/// back now and then.
///
/// Threads  watch(), retire(), take() and changed() by the capture thread; the rest is inside. One order at a time: retire a
///          session, then a new one, or a fault, can be taken.
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "capture/camera_session.hpp"

namespace cyclops {

class CameraSupervisor {
 public:
  explicit CameraSupervisor(const CameraConfig& config);
  ~CameraSupervisor();

  /// From now on this session's settings are read back.
  void watch(const CameraSession& session);
  /// A setting that is no longer as configured; told once.
  [[nodiscard]] std::optional<Error> changed();
  /// Ends `session` (may be null) and opens the camera again until that works.
  void retire(std::unique_ptr<CameraSession> session);
  struct News {
    std::unique_ptr<CameraSession> session;
    std::optional<Error> fault;  ///< an attempt failed for another reason than the one before it
  };
  /// What has happened, waiting at most `timeout`; empty when nothing has.
  News take(Duration timeout);
  [[nodiscard]] std::uint64_t failed_opens() const;

 private:
  void run();
  bool wait_for_order();
  void verify();
  bool end_session(std::unique_ptr<CameraSession> session);
  void open_again();
  bool pause(Duration time);

  const CameraConfig config_;
  mutable std::mutex mutex_;
  std::condition_variable order_, news_;
  std::unique_ptr<CameraSession> to_end_;
  std::unique_ptr<CameraSession> fresh_;
  std::optional<Error> fault_;
  std::string last_fault_;
  std::uint64_t failed_opens_{0};
  arv::Owner<ArvCamera> watched_;
  std::optional<Error> changed_;
  std::atomic<bool> has_changed_{false};
  bool wanted_{false};
  bool stopping_{false};
  std::thread thread_;
};

}  // namespace cyclops
