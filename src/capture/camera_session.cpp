#include "capture/camera_session.hpp"

#include <pthread.h>
#include <time.h>

#include <chrono>
#include <cstdlib>
#include <cstring>

namespace cyclops {
namespace {

constexpr std::size_t kAlign = 64;

std::int64_t monotonic_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}
std::uint8_t* data_of(ArvBuffer* buffer) { return static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, nullptr))); }

}  // namespace

CameraSession::CameraSession(const CameraConfig& config, OpenCamera open)
    : config_(config),
      open_(std::move(open)),
      missing_rows_(config.row_bytes(), config.height_px, open_.packet_bytes),
      started_(static_cast<std::size_t>(config.buffers) + 1),
      ready_(static_cast<std::size_t>(config.buffers) + 1) {}

Result<std::unique_ptr<CameraSession>> CameraSession::open(const CameraConfig& config) {
  auto camera = open_camera(config);
  if (!camera) return camera.error();
  std::unique_ptr<CameraSession> session(new CameraSession(config, std::move(camera).value()));
  CYCLOPS_TRY(session->start());
  return session;
}

Result<> CameraSession::start() {
  const std::string where = "camera " + config_.address;
  arv::Fault fault;
  stream_.reset(arv_camera_create_stream(open_.camera.get(), &CameraSession::on_stream, this, fault.out()));
  if (fault.failed() || !stream_) return make_error(ErrorCode::kIo, where, "no stream: " + fault.text());
  g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", config_.socket_buffer_bytes,
               "packet-timeout", static_cast<guint>(config_.packet_timeout.ns / 1000), "frame-retention",
               static_cast<guint>(config_.frame_retention.ns / 1000), "packet-request-ratio", 1.0, nullptr);
  CYCLOPS_TRY(make_buffers());
  arv_camera_start_acquisition(open_.camera.get(), fault.out());
  if (fault.failed()) return make_error(ErrorCode::kIo, where + ": AcquisitionStart", fault.text());
  return Ok{};
}

Result<> CameraSession::make_buffers() {
  // One block, touched now, so that no page is missing later; 64 readable bytes after each image.
  const std::size_t payload = config_.payload_bytes();
  const std::size_t stride = (payload + kAlign - 1) / kAlign * kAlign + kAlign;
  const std::size_t total = stride * static_cast<std::size_t>(config_.buffers);
  memory_.reset(static_cast<std::uint8_t*>(std::aligned_alloc(kAlign, total)));
  if (!memory_) return make_error(ErrorCode::kFull, "camera " + config_.address, "no memory for " + std::to_string(total) + " bytes of frames");
  std::memset(memory_.get(), 0, total);
  for (int i = 0; i < config_.buffers; ++i)
    recycle(arv_buffer_new(payload, memory_.get() + static_cast<std::size_t>(i) * stride));
  return Ok{};
}

CameraSession::~CameraSession() {
  CYCLOPS_ASSERT(lent() == 0);
  // A camera that is gone would block AcquisitionStop for seconds; closing the stream channel stops it as well.
  if (stream_ && probe_camera(config_.address, config_.probe_timeout).ok()) arv_camera_stop_acquisition(open_.camera.get(), nullptr);
  stream_.reset();
  open_.camera.reset();
}

void CameraSession::recycle(ArvBuffer* buffer) {
  missing_rows_.arm(data_of(buffer));
  arv_buffer_set_frame_id(buffer, 0);  // a buffer that never sees its leader keeps these
  arv_buffer_set_timestamp(buffer, 0);
  arv_buffer_set_system_timestamp(buffer, 0);
  arv_stream_push_buffer(stream_.get(), buffer);
}

void CameraSession::take_back(ArvBuffer* buffer) {
  recycle(buffer);
  lent_.fetch_sub(1, std::memory_order_release);  // from here on the session may end
}

Received CameraSession::wait(Duration timeout) {
  Received next;
  {
    std::unique_lock lock(mutex_);
    if (!came_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return ready_in_ != ready_out_; })) return {};
    next = ready_[ready_out_++ % ready_.size()];
  }
  // The library also gives back buffers of packets it cannot make sense of; those were never announced.
  while (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_.get())) {
    if (buffer == next.buffer) return next;
    ++unexpected_;
    recycle(buffer);
  }
  CYCLOPS_ASSERT(false && "an announced buffer is in the output queue");
  return {};
}

void CameraSession::on_stream(void* self, ArvStreamCallbackType type, ArvBuffer* buffer) {
  auto* session = static_cast<CameraSession*>(self);
  switch (type) {
    case ARV_STREAM_CALLBACK_TYPE_INIT: return session->on_thread_start();
    case ARV_STREAM_CALLBACK_TYPE_START_BUFFER: return session->on_start_of_frame();
    case ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE: return session->on_end_of_frame(buffer);
    case ARV_STREAM_CALLBACK_TYPE_EXIT: return;
  }
}

void CameraSession::on_thread_start() {
  if (config_.stream_priority == 0) return;
  const sched_param p{config_.stream_priority};
  priority_refused_ = pthread_setschedparam(pthread_self(), SCHED_FIFO, &p) != 0;
}

void CameraSession::on_start_of_frame() { started_[start_in_++ % started_.size()] = monotonic_ns(); }

void CameraSession::on_end_of_frame(ArvBuffer* buffer) {
  const std::int64_t arrival = started_[start_out_++ % started_.size()];
  {
    const std::lock_guard lock(mutex_);
    ready_[ready_in_++ % ready_.size()] = {buffer, arrival};  // never full: it has a place for every buffer
  }
  came_.notify_one();
}

PacketCounters CameraSession::packets() const {
  const auto get = [&](const char* name) { return arv_stream_get_info_uint64_by_name(stream_.get(), name); };
  return {get("n_received_packets"), get("n_missing_packets"),    get("n_resend_requests"), get("n_resent_packets"),
          get("n_error_packets"),    get("n_duplicated_packets"), get("n_ignored_packets"), get("n_underruns")};
}

}  // namespace cyclops
