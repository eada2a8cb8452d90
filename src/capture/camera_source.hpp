#pragma once
/// Frames from a GigE Vision camera, for as long as the service runs: lost cameras are opened again.
///
///   auto source = CameraSource::open(config);                 // the camera is there and as configured, or an Error
///   for (;;) std::visit(..., source->poll(Duration::from_ms(100)));
///
/// Settings exposure and frame rate are read back four times a second; a camera that has changed them is opened, so set, again.
/// Frozen   a picture that comes again bit by bit more often than `frozen_after` is not believed: missing frames until there is a
///          new one, and a CameraFault after the first of them.
/// Events   CameraStarted comes before the first frame of each stream: numbers and clock of the camera may have changed, so
///          whoever fits them starts anew. CameraFrame: complete, partial (rows in `missing` hold nothing) or missing (only
///          seq, arrival and, where not 0, id and tick). CameraLost: the stream ended and is being opened again.
///          CameraFault: a frame or an attempt to open was not as configured; it says which value. CameraTimeout: nothing.
/// Time     t_arrival is CLOCK_MONOTONIC at the first packet. camera_tick_ns is the camera's clock scaled to ns, 0 when the
///          camera has none. t_mid is not filled in here.
/// Memory   the receive buffers are the pool: a frame is a view into one and goes back when its handle dies. After open()
///          neither poll() nor the handle uses the heap while a stream lives. At most `buffers` - 2 handles at a time,
///          or frames are lost for want of a buffer (counted).
/// Threads  poll() by one thread, which may be a real-time one: opening and closing, which block for seconds, run on a
///          supervisor thread inside. Handles may die on any thread, all before the source does. counters() by any thread.
/// Errors   open(): see capture/camera_settings.hpp, and kInvalid for a configuration out of range.
#include <memory>
#include <variant>

#include "capture/camera_config.hpp"
#include "capture/camera_counters.hpp"
#include "msg/frame.hpp"

typedef struct _ArvBuffer ArvBuffer;  // NOLINT: the C library's name

namespace cyclops {

class CameraSession;

class CameraFrame {
 public:
  CameraFrame(CameraFrame&& other) noexcept;
  CameraFrame& operator=(CameraFrame&& other) noexcept;
  ~CameraFrame();

  FrameInfo info;
  ImageView image;  ///< null when info.status is kMissing
  RowMask missing;

 private:
  friend class CameraSource;
  CameraFrame(CameraSession* session, ArvBuffer* buffer);
  void give_back();
  CameraSession* session_;
  ArvBuffer* buffer_;
};

struct CameraStarted {
  std::uint32_t stream{0};     ///< 1 is the first
  std::uint64_t tick_hz{0};    ///< resolution of the camera clock; 0: it has none
  int packet_bytes{0};
  Duration away{};             ///< since the stream before was found lost
  bool priority_refused{false};  ///< the receiving thread runs without the priority asked for
  std::string camera;          ///< vendor, model, serial
};
enum class LossReason {
  kSilence,      ///< no frame for the time of the watchdog
  kNumbersBack,  ///< packets came, but of frames whose numbers went back
  kNumberJump,   ///< the number of a frame does not follow
  kSettings,     ///< exposure or frame rate is no longer as configured
  kWrongSize,    ///< as many frames as the watchdog has periods were not of the size or format configured
};
[[nodiscard]] const char* to_string(LossReason reason);
struct CameraLost {
  LossReason reason{LossReason::kSilence};
  Duration silence{};  ///< since the last frame
  std::string detail;  ///< which setting; else empty
};
struct CameraFault {
  Error error;
};
struct CameraTimeout {};
using CameraEvent = std::variant<CameraTimeout, CameraFrame, CameraStarted, CameraLost, CameraFault>;

class CameraSource {
 public:
  static Result<CameraSource> open(const CameraConfig& config);
  CameraSource(CameraSource&&) noexcept;
  CameraSource& operator=(CameraSource&&) noexcept;
  ~CameraSource();

  CameraEvent poll(Duration timeout);
  [[nodiscard]] CameraCounters counters() const;

 private:
  struct State;
  explicit CameraSource(std::unique_ptr<State> state);
  CameraEvent wait_for_stream(Duration timeout);
  CameraEvent begin(std::unique_ptr<CameraSession> session);
  CameraEvent lose(LossReason reason, std::string detail = {});
  void alive();
  CameraEvent handle(ArvBuffer* buffer, std::int64_t arrival_ns);
  bool as_configured(ArvBuffer* buffer);
  bool repeated(const CameraFrame& frame);
  CameraEvent wrong_size(ArvBuffer* buffer, std::uint64_t seq);
  CameraEvent no_leader(ArvBuffer* buffer, std::int64_t arrival_ns);
  CameraFrame make_frame(ArvBuffer* buffer, std::uint64_t seq, std::int64_t arrival_ns) const;
  void count_frame(CameraFrame& frame);
  void fill_rows(CameraFrame& frame);
  int miss_all(CameraFrame& frame) const;
  void publish_counters();
  std::unique_ptr<State> state_;
};

}  // namespace cyclops
