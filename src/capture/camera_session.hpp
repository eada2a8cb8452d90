#pragma once
/// One open stream: camera, buffers and the thread that receives. Made and ended off the real-time thread.
///
/// Threads  open() and the destructor block (up to some 7 s when the camera is gone) and belong to the supervisor;
///          wait() belongs to the capture thread; recycle() to any. Memory: everything at open(); wait() and recycle()
///          use no heap of ours (the receiving library makes a small object a frame).
#include <sched.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "capture/camera_counters.hpp"
#include "capture/camera_settings.hpp"
#include "capture/missing_rows.hpp"

namespace cyclops {

/// A buffer the network is finished with.
struct Received {
  ArvBuffer* buffer{nullptr};  ///< null: nothing came in time
  std::int64_t arrival_ns{0};  ///< first packet, CLOCK_MONOTONIC
};

class CameraSession {
 public:
  static Result<std::unique_ptr<CameraSession>> open(const CameraConfig& config);
  ~CameraSession();
  CameraSession(const CameraSession&) = delete;
  CameraSession& operator=(const CameraSession&) = delete;

  Received wait(Duration timeout);
  /// Gives a buffer back to the network; the last thing its reader does with it.
  void recycle(ArvBuffer* buffer);
  /// Handles in the hands of readers; the session may end when there are none.
  void lend() { lent_.fetch_add(1, std::memory_order_relaxed); }
  void take_back(ArvBuffer* buffer);
  [[nodiscard]] int lent() const { return lent_.load(std::memory_order_acquire); }

  [[nodiscard]] PacketCounters packets() const;
  [[nodiscard]] std::uint64_t unexpected() const { return unexpected_; }
  [[nodiscard]] const OpenCamera& camera() const { return open_; }
  [[nodiscard]] const MissingRows& missing_rows() const { return missing_rows_; }
  [[nodiscard]] bool priority_refused() const { return priority_refused_; }

 private:
  struct Free {
    void operator()(std::uint8_t* p) const { std::free(p); }
  };
  CameraSession(const CameraConfig& config, OpenCamera open);
  Result<> start();
  Result<> make_buffers();
  static void on_stream(void* self, ArvStreamCallbackType type, ArvBuffer* buffer);
  void on_start_of_frame();
  void on_end_of_frame(ArvBuffer* buffer);
  void on_thread_start();

  const CameraConfig config_;
  OpenCamera open_;
  MissingRows missing_rows_;
  std::unique_ptr<std::uint8_t, Free> memory_;
  arv::Owner<ArvStream> stream_;
  std::atomic<int> lent_{0};
  std::atomic<bool> priority_refused_{false};
  std::uint64_t unexpected_{0};

  // Arrival stamps travel with their buffers: frames are closed in the order in which they were started.
  std::vector<std::int64_t> started_;  // stream thread's ring
  std::size_t start_in_{0}, start_out_{0};
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<Received> ready_;  // ring under mutex_
  std::size_t ready_in_{0}, ready_out_{0};
};

}  // namespace cyclops
