#include "service/recorder.hpp"

#include <sys/statvfs.h>

#include <chrono>

#include "base/log.hpp"
#include "record/flight.hpp"
#include "service/pipeline_state.hpp"

namespace cyclops {
namespace {

constexpr Duration kLogEvery = Duration::from_ms(100);
constexpr Duration kSyncEvery = Duration::from_ms(500);
constexpr std::size_t kInputRoom = std::size_t{4} << 20;        // twice; some 20 s of 2 x 400 Hz TSPI
constexpr std::size_t kPublishedRoom = std::size_t{12} << 20;   // twice; some 10 s of 60 frames/s
constexpr std::int64_t kRateWindow_ns = 5'000'000'000;

}  // namespace

Recorder::Recorder(const RecordOptions& options, const Rig& rig, EventBus& events, bool own_clock)
    : options_(options),
      events_(events),
      own_clock_(own_clock),
      format_(rig.device.format),
      width_(rig.device.width_px),
      height_(rig.device.height_px),
      nominal_bytes_s_(static_cast<double>(rig.device.payload_bytes()) * rig.device.frame_rate_hz),
      inputs_(kInputRoom),
      published_(kPublishedRoom) {}

Recorder::~Recorder() { (void)stop().ok(); }

Time Recorder::now() const { return own_clock_ ? Time{service_now_us_ * 1000} : Time{host_now_ns()}; }

// --- what comes in -----------------------------------------------------------------------------------------------

template <class Message>
void Recorder::input(Time t, const char* channel, const Message& message) {
  service_now_us_ = t.ns / 1000;
  const Encoded bytes = encode_into(message, room_);
  CYCLOPS_ASSERT(static_cast<bool>(bytes));
  inputs_.buffer.append(t.ns / 1000, channel, bytes.data, bytes.size);
}

void Recorder::acquisition(Time t, const Acquisition& change) {
  fill(acquisition_, change);
  input(t, channel::kAcquisition, acquisition_);
}

void Recorder::edge(Time t, const StrobeEdge& edge, StrobeLine line) {
  fill(edge_, LineEdge{edge, line});
  input(t, channel::kStrobe, edge_);
}

void Recorder::mark(Time t, const TimeMark& mark) {
  fill(mark_, mark, MarkSource::kRecorded);
  input(t, channel::kTimeMark, mark_);
}

void Recorder::tspi(const ArrivedTspi& tspi, Time arrival) {
  service_now_us_ = arrival.ns / 1000;
  inputs_.buffer.append(arrival.ns / 1000, channel::tspi(tspi.report.aircraft), tspi.bytes.begin(), tspi.bytes.size());
}

std::int64_t Recorder::frame(Time t, const FrameInfo& info) {
  FrameIndex index;
  index.info = info;
  index.format = format_;
  index.width = width_;
  index.height = height_;
  index.recorded_in = "frames.lcm";
  index.recorded_at = next_frame_++;
  fill(frame_, index);
  input(t, channel::kFrame, frame_);
  return index.recorded_at;
}

void Recorder::published(const char* channel, const void* data, std::size_t bytes) { published_.buffer.append(now().ns / 1000, channel, data, bytes); }

bool Recorder::has_room() const { return !disk_full_ && queue_.size() < queue_.places(); }

void Recorder::pixels(CameraFrame&& frame, std::int64_t number, Time t_mid) {
  if (first_t_mid_.ns == 0) first_t_mid_ = t_mid;
  last_t_mid_ = t_mid;
  if (disk_full_) return lost(full_, "record.frames_disk_full", "less than the reserve is free");
  if (!queue_.try_push(FrameJob{std::move(frame), number, now()})) lost(queue_full_, "record.frames_queue_full", "the disk is too slow");
}

/// Says it at the 1st, 2nd, 4th, 8th ... time.
void Recorder::lost(std::atomic<std::uint64_t>& counter, const char* code, const std::string& why) {
  const std::uint64_t n = ++counter;
  if ((n & (n - 1)) == 0) events_.post(Time{host_now_ns()}, EventLevel::kWarning, "record", code, "pixels of a frame not recorded: " + why, static_cast<std::int64_t>(n));
}

// --- onto the disk -----------------------------------------------------------------------------------------------

void Recorder::write_log(Log& log, const record::EventBuffer::Piece& piece) {
  if (piece.bytes.empty()) return;
  auto done = log.stream->write(Time{host_now_ns()}, {piece.bytes});
  if (done.ok()) {
    log.events += piece.events;
    return;
  }
  if (log.lost.exchange(log.lost + piece.events) == 0) events_.post(Time{host_now_ns()}, EventLevel::kFault, "record", "record.messages_lost", done.error().message());
}

void Recorder::run_log() {
  for (int round = 0;; ++round) {
    const bool last = stopping_;
    // Taken in this order and written in the other: an answer is never on the disk without what it answers.
    const auto published = published_.buffer.take();
    const auto inputs = inputs_.buffer.take();
    write_log(inputs_, inputs);
    write_log(published_, published);
    for (Log* log : {&inputs_, &published_}) {
      if (round % 5 == 0) (void)log->stream->seal(Time{host_now_ns()}).ok();  // failed: with the next
    }
    if (last) return;
    std::this_thread::sleep_for(std::chrono::nanoseconds(kLogEvery.ns));
  }
}

void Recorder::run_frames() {
  for (;;) {
    auto job = queue_.pop(kSyncEvery);
    if (job) write_frame(*job);
    else if (queue_.finished()) return;
  }
}

void Recorder::write_frame(const FrameJob& job) {
  const CameraFrame& f = job.frame;
  FrameDataView view;
  view.camera_frame_id = f.info.camera_frame_id;
  view.camera_tick_ns = f.info.camera_tick_ns;
  view.exposure = f.info.exposure;
  view.status = f.image.data != nullptr ? f.info.status : FrameStatus::kMissing;
  view.format = format_;
  view.width = width_;
  view.height = height_;
  view.missing = f.missing;
  if (view.status == FrameStatus::kComplete) view.missing = {};
  if (view.status != FrameStatus::kMissing) {
    CYCLOPS_ASSERT(f.image.stride_bytes == width_ * bytes_per_pixel(format_));  // rows of a GVSP frame have no gaps
    view.pixels = {f.image.data, f.image.size_bytes()};
  }
  const Encoded head = encode_head_into(view, frame_head_);
  const std::size_t n = record::put_event_head(event_head_.data(), job.number, job.t.ns / 1000, channel::kFrameData, head.size + view.pixels.size());
  const auto done = frames_->write(Time{host_now_ns()}, {{event_head_.data(), n}, {head.data, head.size}, view.pixels});
  if (done.ok()) {
    ++frames_written_;
    frame_bytes_ += n + head.size + view.pixels.size();
    pace(static_cast<std::int64_t>(view.pixels.size()));
  } else if (done.error().code == ErrorCode::kFull) {
    lost(full_, "record.frames_disk_full", done.error().message());
  } else {
    lost(error_, "record.frames_disk_error", done.error().message());
  }
}

void Recorder::pace(std::int64_t bytes) {
  if (options_.limit_mbps <= 0) return;
  paced_ns_ = std::max(paced_ns_, host_now_ns() - 100'000'000) + static_cast<std::int64_t>(static_cast<double>(bytes) * 1e3 / options_.limit_mbps);
  if (const std::int64_t wait = paced_ns_ - host_now_ns(); wait > 0 && !stopping_) std::this_thread::sleep_for(std::chrono::nanoseconds(wait));
}

void Recorder::run_sync() {
  log::Throttle trouble(10);
  std::uint64_t held = 0;
  while (!stopping_) {
    std::this_thread::sleep_for(std::chrono::nanoseconds(kSyncEvery.ns));
    for (record::LogStream* stream : {inputs_.stream.get(), published_.stream.get(), frames_.get()})
      if (const auto done = stream->sync(); !done.ok() && trouble.pass(host_now_ns(), held)) log::error("record", done.error().message());
    look_at_room();
  }
}

void Recorder::look_at_room() {
  struct statvfs fs_info {};
  if (::statvfs(folder_.c_str(), &fs_info) != 0) return;
  const auto free = static_cast<std::int64_t>(fs_info.f_bavail) * static_cast<std::int64_t>(fs_info.f_frsize);
  const std::int64_t over = free - options_.reserve_bytes;
  // Twice the way back, so that it does not flicker.
  const bool full = over < (disk_full_ ? options_.reserve_bytes / 4 : 0);
  if (full != disk_full_.exchange(full)) {
    const std::string text = std::to_string(free >> 20) + " MB free, " + std::to_string(options_.reserve_bytes >> 20) + " MB are kept for messages";
    if (full) events_.post(Time{host_now_ns()}, EventLevel::kFault, "record", "record.disk_full", text);
    else events_.post(Time{host_now_ns()}, EventLevel::kRecovery, "record", "record.disk_room", text);
  }
  const std::int64_t now_ns = host_now_ns();
  const std::uint64_t bytes = frame_bytes_;
  if (rate_from_ns_ == 0 || now_ns - rate_from_ns_ >= kRateWindow_ns) {
    bytes_s_ = rate_from_ns_ == 0 ? 0 : static_cast<double>(bytes - rate_from_bytes_) * 1e9 / static_cast<double>(now_ns - rate_from_ns_);
    rate_from_ns_ = now_ns;
    rate_from_bytes_ = bytes;
  }
  const double rate = bytes_s_ > 0 ? bytes_s_ : nominal_bytes_s_;
  left_min_ = static_cast<float>(std::max<double>(0, static_cast<double>(over)) / rate / 60);
}

RecordCounts Recorder::counts() const {
  RecordCounts c;
  c.on = true;
  c.frames = frames_written_;
  c.frames_queue_full = queue_full_;
  c.frames_disk_full = full_;
  c.frames_disk_error = error_;
  c.inputs = inputs_.events;
  c.inputs_lost = inputs_.lost + inputs_.buffer.refused();
  c.published = published_.events;
  c.published_lost = published_.lost + published_.buffer.refused();
  c.bytes = frame_bytes_;
  c.disk_left_min = left_min_;
  return c;
}

Result<> Recorder::stop() {
  if (stopping_.exchange(true)) return Ok{};
  queue_.close();
  for (std::thread* t : {&frames_thread_, &log_thread_, &sync_thread_})
    if (t->joinable()) t->join();
  if (!frames_) return Ok{};
  const Time now_ns{host_now_ns()};
  for (record::LogStream* stream : {inputs_.stream.get(), published_.stream.get(), frames_.get()}) CYCLOPS_TRY(stream->close(now_ns));
  FlightManifest m;
  m.name = name_;
  m.origin = "recorded";
  m.source = source_;
  m.frames = next_frame_;
  m.pixels = static_cast<std::int64_t>(frames_written_);
  m.first_frame_ns = first_t_mid_.ns;
  m.last_frame_ns = last_t_mid_.ns;
  return write_manifest(folder_, m);
}

}  // namespace cyclops
