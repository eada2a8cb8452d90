#pragma once
/// Records a sortie: inputs in the order in which the chain used them, all that was published, and the pixels.
///
///   thread      wakes on            does
///   rec-log     100 ms              messages.lcm and published.lcm
///   rec-frames  a frame             frames.lcm, straight from the buffer the camera filled
///   rec-sync    500 ms              brings all to the disk; room left
///
/// Nobody who gives waits: messages are copied into buffers of fixed size, frames are handed over. What finds no room, or a
/// disk that does not take it, is counted by its cause and said in an EVENT; tracking goes on. Below `reserve_bytes` of free
/// disk only messages are recorded, until there is room again.
/// Memory   on start; none a frame.
/// Errors   start(): folder there already or not writable, rig or profile not readable.
#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "capture/camera_source.hpp"
#include "record/event_buffer.hpp"
#include "record/log_stream.hpp"
#include "record/sortie.hpp"
#include "service/events.hpp"
#include "service/inputs.hpp"
#include "service/record_options.hpp"
#include "service/rig.hpp"
#include "wire/codec.hpp"

namespace cyclops {

/// Frames, inputs and published messages that are not in the record, and why.
struct RecordCounts {
  bool on{false};
  std::uint64_t frames{0};               ///< with their pixels
  std::uint64_t frames_queue_full{0};    ///< the disk was too slow
  std::uint64_t frames_disk_full{0};
  std::uint64_t frames_disk_error{0};
  std::uint64_t inputs{0};               ///< recorded
  std::uint64_t inputs_lost{0};
  std::uint64_t published{0};
  std::uint64_t published_lost{0};
  std::uint64_t bytes{0};                ///< written, all files
  float disk_left_min{-1};               ///< at the present rate; -1 not recording
  [[nodiscard]] std::uint64_t frames_lost() const { return frames_queue_full + frames_disk_full + frames_disk_error; }
};

class Recorder {
 public:
  static constexpr std::size_t kFramePlaces = 40;   ///< frames that may wait for the disk, each in a buffer of the camera

  /// `profile_path` may be empty: the built-in profile. `own_clock`: the service clock is a bench's.
  static Result<std::unique_ptr<Recorder>> start(const RecordOptions& options, const Rig& rig, const std::string& profile_name, const std::string& profile_path,
                                                 bool own_clock, EventBus& events);
  ~Recorder();

  // The chain's thread. `t`: service clock, whole us.
  void acquisition(Time t, const Acquisition& change);
  void edge(Time t, const StrobeEdge& edge, StrobeLine line);
  void mark(Time t, const TimeMark& mark);
  void tspi(const ArrivedTspi& tspi, Time arrival);
  /// Returns the number under which its pixels belong into frames.lcm.
  std::int64_t frame(Time t, const FrameInfo& info);

  // The publishing thread.
  void published(const char* channel, const void* data, std::size_t bytes);
  /// True: the pixels given next will be taken.
  [[nodiscard]] bool has_room() const;
  void pixels(CameraFrame&& frame, std::int64_t number, Time t_mid);

  /// Any thread.
  [[nodiscard]] RecordCounts counts() const;
  [[nodiscard]] const std::string& folder() const { return folder_; }
  /// Writes what is left and the manifest; everybody else has stopped. Error: the folder did not become a flight.
  Result<> stop();

 private:
  struct FrameJob {
    CameraFrame frame;
    std::int64_t number{0};
    Time t{};
  };
  struct Log {
    explicit Log(std::size_t room) : buffer(room) {}
    record::EventBuffer buffer;
    std::unique_ptr<record::LogStream> stream;
    std::atomic<std::uint64_t> events{0}, lost{0};
  };
  Recorder(const RecordOptions& options, const Rig& rig, EventBus& events, bool own_clock);
  Result<> open(const std::string& folder);
  template <class Message>
  void input(Time t, const char* channel, const Message& message);
  [[nodiscard]] Time now() const;
  void run_log();
  void write_log(Log& log, const record::EventBuffer::Piece& piece);
  void run_frames();
  void write_frame(const FrameJob& job);
  void pace(std::int64_t bytes);
  void run_sync();
  void look_at_room();
  void lost(std::atomic<std::uint64_t>& counter, const char* code, const std::string& why);

  RecordOptions options_;
  EventBus& events_;
  const bool own_clock_;
  const PixelFormat format_;
  const int width_, height_;
  const double nominal_bytes_s_;
  std::string folder_, name_, source_;

  Log inputs_, published_;
  std::unique_ptr<record::LogStream> frames_;
  BoundedQueue<FrameJob> queue_{kFramePlaces};
  std::atomic<std::int64_t> service_now_us_{0};   // of the newest input, when the clock is a bench's
  std::atomic<bool> disk_full_{false}, stopping_{false};
  std::atomic<std::uint64_t> frames_written_{0}, queue_full_{0}, full_{0}, error_{0}, frame_bytes_{0};
  std::atomic<float> left_min_{-1};
  std::thread log_thread_, frames_thread_, sync_thread_;

  // of the chain's thread
  std::int64_t next_frame_{0};
  acquisition_t acquisition_{};
  strobe_edge_t edge_{};
  time_mark_t mark_{};
  frame_index_t frame_{};
  std::array<std::uint8_t, 1024> room_{};
  // of the publishing thread
  Time first_t_mid_{}, last_t_mid_{};
  // of rec-frames
  std::int64_t paced_ns_{0};
  std::array<std::uint8_t, record::kEventHeadBytes + record::kMaxChannelBytes> event_head_{};
  std::array<std::uint8_t, kMaxFrameHeadBytes> frame_head_{};
  // of rec-sync
  std::int64_t rate_from_ns_{0};
  std::uint64_t rate_from_bytes_{0};
  double bytes_s_{0};
};

}  // namespace cyclops
