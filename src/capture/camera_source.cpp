#include "capture/camera_source.hpp"

#include <time.h>

#include <algorithm>
#include <atomic>
#include <optional>

#include "capture/camera_supervisor.hpp"
#include "capture/frame_numbers.hpp"
#include "capture/frozen_picture.hpp"

namespace cyclops {
namespace {

std::int64_t monotonic_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

ArvPixelFormat arv_format(PixelFormat f) {
  switch (f) {
    case PixelFormat::kMono8: return ARV_PIXEL_FORMAT_MONO_8;
    case PixelFormat::kMono10: return ARV_PIXEL_FORMAT_MONO_10;
    case PixelFormat::kMono12: return ARV_PIXEL_FORMAT_MONO_12;
    case PixelFormat::kMono16: return ARV_PIXEL_FORMAT_MONO_16;
  }
  return 0;
}

PacketCounters operator+(const PacketCounters& a, const PacketCounters& b) {
  return {a.received + b.received, a.missing + b.missing,       a.resend_requested + b.resend_requested, a.resent + b.resent,
          a.refused + b.refused,   a.duplicated + b.duplicated, a.ignored + b.ignored,                   a.no_buffer + b.no_buffer};
}

}  // namespace

const char* to_string(LossReason reason) {
  switch (reason) {
    case LossReason::kSilence: return "no frame came";
    case LossReason::kNumbersBack: return "frame numbers went back";
    case LossReason::kSettings: return "a setting has changed";
    case LossReason::kWrongSize: return "frames are not of the size configured";
    case LossReason::kNumberJump: return "frame number does not follow";
  }
  return "?";
}

CameraFrame::CameraFrame(CameraSession* session, ArvBuffer* buffer) : session_(session), buffer_(buffer) { session_->lend(); }
CameraFrame::CameraFrame(CameraFrame&& o) noexcept
    : info(o.info), image(o.image), missing(o.missing), session_(o.session_), buffer_(std::exchange(o.buffer_, nullptr)) {}
CameraFrame& CameraFrame::operator=(CameraFrame&& o) noexcept {
  if (this == &o) return *this;
  give_back();
  info = o.info;
  image = o.image;
  missing = o.missing;
  session_ = o.session_;
  buffer_ = std::exchange(o.buffer_, nullptr);
  return *this;
}
CameraFrame::~CameraFrame() { give_back(); }
void CameraFrame::give_back() {
  if (buffer_ != nullptr) session_->take_back(buffer_);
  buffer_ = nullptr;
}

struct CameraSource::State {
  explicit State(const CameraConfig& c) : config(c), supervisor(c) {}
  const CameraConfig config;
  std::unique_ptr<CameraSession> session;  // null while the supervisor works on the next one
  bool announced{false};                   // CameraStarted was given for this session
  FrameNumbers numbers;
  std::int64_t last_frame_ns{0};
  Duration silence{};                      // waited in vain since then: a stall of this host is not the camera's silence
  int fruitless{0};                        // streams in a row that ended in silence without a frame
  int wrong_in_a_row{0};
  FrozenPicture pictures;
  bool frozen{false};
  std::optional<Error> to_tell;            // of the frame that was handed out last
  std::int64_t lost_ns{0};
  PacketCounters packets_before;           // of sessions that ended
  PacketCounters packets;                  // of this one
  CameraCounters own;                      // capture thread's
  mutable std::mutex mutex;
  CameraCounters published;                // under mutex
  CameraSupervisor supervisor;             // ends first: it may be reading from the session's camera

  [[nodiscard]] Duration patience() const { return config.patience(fruitless); }
};

CameraSource::CameraSource(std::unique_ptr<State> state) : state_(std::move(state)) {}
CameraSource::CameraSource(CameraSource&&) noexcept = default;
CameraSource& CameraSource::operator=(CameraSource&&) noexcept = default;
CameraSource::~CameraSource() = default;

Result<CameraSource> CameraSource::open(const CameraConfig& config) {
  CYCLOPS_TRY(validated(config));
  auto session = CameraSession::open(config);
  if (!session) return session.error();
  auto state = std::make_unique<State>(config);
  state->session = std::move(session).value();
  return CameraSource(std::move(state));
}

CameraEvent CameraSource::poll(Duration timeout) {
  State& s = *state_;
  if (s.to_tell) return CameraFault{*std::exchange(s.to_tell, std::nullopt)};
  if (!s.session) return wait_for_stream(timeout);
  if (!s.announced) return begin(std::move(s.session));
  if (auto changed = s.supervisor.changed()) return lose(LossReason::kSettings, changed->message());
  const Duration wait = std::min(timeout, s.patience() - s.silence);
  const Received got = s.session->wait(wait);
  if (got.buffer != nullptr) {
    CameraEvent event = handle(got.buffer, got.arrival_ns);
    publish_counters();
    return event;
  }
  s.silence = s.silence + wait;
  if (s.silence < s.patience()) return CameraTimeout{};
  // A stream whose numbers went back is silent too, but its packets keep coming and are ignored.
  const std::uint64_t ignored = s.session->packets().ignored - s.packets.ignored;
  const bool packets_came = ignored >= static_cast<std::uint64_t>(2 * s.config.watchdog_periods);
  ++s.fruitless;
  return lose(packets_came ? LossReason::kNumbersBack : LossReason::kSilence);
}

/// A frame came, good or not so good: the camera is there.
void CameraSource::alive() {
  state_->last_frame_ns = monotonic_ns();
  state_->silence = {};
}

CameraEvent CameraSource::wait_for_stream(Duration timeout) {
  auto news = state_->supervisor.take(timeout);
  if (news.fault) {
    publish_counters();
    return CameraFault{std::move(*news.fault)};
  }
  if (!news.session) return CameraTimeout{};
  state_->numbers.new_stream();
  return begin(std::move(news.session));
}

CameraEvent CameraSource::begin(std::unique_ptr<CameraSession> session) {
  State& s = *state_;
  s.session = std::move(session);
  s.announced = true;
  s.packets = {};
  s.wrong_in_a_row = 0;
  s.frozen = false;
  s.supervisor.watch(*s.session);
  alive();
  ++s.own.starts;
  publish_counters();
  const OpenCamera& camera = s.session->camera();
  return CameraStarted{static_cast<std::uint32_t>(s.own.starts), camera.tick_hz, camera.packet_bytes,
                       s.lost_ns == 0 ? Duration{} : Duration{s.last_frame_ns - s.lost_ns}, s.session->priority_refused(),
                       camera.found.vendor + " " + camera.found.model + " " + camera.found.serial};
}

CameraEvent CameraSource::lose(LossReason reason, std::string detail) {
  State& s = *state_;
  s.lost_ns = monotonic_ns();
  ++s.own.losses;
  publish_counters();
  s.packets_before = s.packets_before + s.packets;
  s.packets = {};
  s.own.unexpected += s.session->unexpected();
  s.supervisor.retire(std::move(s.session));
  return CameraLost{reason, Duration{s.lost_ns - s.last_frame_ns}, std::move(detail)};
}

CameraEvent CameraSource::handle(ArvBuffer* buffer, std::int64_t arrival_ns) {
  State& s = *state_;
  if (arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_ABORTED) {
    ++s.own.aborted;
    s.session->recycle(buffer);
    return CameraTimeout{};
  }
  const std::uint64_t id = arv_buffer_get_frame_id(buffer);
  if (id == 0) return no_leader(buffer, arrival_ns);
  const bool starved = s.session->packets().no_buffer > s.packets.no_buffer;
  const FrameNumbers::Step step = s.numbers.next(id);
  if (step.restarted) {
    s.session->recycle(buffer);
    return lose(LossReason::kNumberJump);
  }
  (starved ? s.own.lost_no_buffer : s.own.lost_gap) += step.lost;
  if (!as_configured(buffer)) return wrong_size(buffer, step.seq);
  alive();
  s.fruitless = 0;
  CameraFrame frame = make_frame(buffer, step.seq, arrival_ns);
  fill_rows(frame);
  const bool was_frozen = s.frozen;
  s.frozen = repeated(frame);
  if (!s.frozen) {
    count_frame(frame);
    return frame;
  }
  ++s.own.lost_frozen;
  frame.info.missing_rows = static_cast<std::uint32_t>(miss_all(frame));
  frame.info.status = FrameStatus::kMissing;
  frame.image = {};
  if (!was_frozen)
    s.to_tell = make_error(ErrorCode::kCorrupt, "camera " + s.config.address + ": frame " + std::to_string(frame.info.seq),
                           "has the picture of the frames before, bit for bit, more than " + std::to_string(s.config.frozen_after) + " times");
  return frame;
}

/// Is this the picture of earlier frames? Of an incomplete one that cannot be said.
bool CameraSource::repeated(const CameraFrame& frame) {
  State& s = *state_;
  if (s.config.frozen_after == 0) return false;
  if (frame.info.status != FrameStatus::kComplete) return false;
  return s.pictures.repeats(frame.image) > s.config.frozen_after;
}

/// The library tells size and format of complete frames only. An incomplete one is taken for what the one before it was.
bool CameraSource::as_configured(ArvBuffer* buffer) {
  State& s = *state_;
  if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_IMAGE) return false;
  if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS) return s.wrong_in_a_row == 0;
  int x = 0, y = 0, width = 0, height = 0, pad_x = 0, pad_y = 0;
  arv_buffer_get_image_region(buffer, &x, &y, &width, &height);
  arv_buffer_get_image_padding(buffer, &pad_x, &pad_y);
  const bool good = width == s.config.width_px && height == s.config.height_px && pad_x == 0 && pad_y == 0 &&
                    arv_buffer_get_image_pixel_format(buffer) == arv_format(s.config.format);
  if (good) s.wrong_in_a_row = 0;
  return good;
}

CameraFrame CameraSource::make_frame(ArvBuffer* buffer, std::uint64_t seq, std::int64_t arrival_ns) const {
  const State& s = *state_;
  CameraFrame frame(s.session.get(), buffer);
  frame.info.seq = seq;
  frame.info.camera_frame_id = arv_buffer_get_frame_id(buffer);
  if (s.session->camera().tick_hz != 0) frame.info.camera_tick_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
  frame.info.t_arrival = Time{arrival_ns};
  frame.info.exposure = Duration::from_seconds(s.config.exposure_us * 1e-6);
  return frame;
}

int CameraSource::miss_all(CameraFrame& frame) const {
  for (int v = 0; v < state_->config.height_px; ++v) frame.missing.set_missing(v);
  return state_->config.height_px;
}

/// Which pixels are there: the library's word when it has all packets, else the marks.
void CameraSource::fill_rows(CameraFrame& frame) {
  const State& s = *state_;
  std::size_t received = 0;
  const void* data = arv_buffer_get_data(frame.buffer_, &received);
  const auto* pixels = static_cast<const std::uint8_t*>(data);
  const bool all = arv_buffer_get_status(frame.buffer_) == ARV_BUFFER_STATUS_SUCCESS && received == s.config.payload_bytes();
  int missing = all ? 0 : s.session->missing_rows().find(pixels, frame.missing);
  if (!all && missing == 0 && arv_buffer_get_status(frame.buffer_) == ARV_BUFFER_STATUS_SUCCESS) missing = miss_all(frame);  // bytes too few, none missed
  frame.info.missing_rows = static_cast<std::uint32_t>(missing);
  frame.info.status = missing == 0                    ? FrameStatus::kComplete
                      : missing < s.config.height_px ? FrameStatus::kPartial
                                                     : FrameStatus::kMissing;
  if (frame.info.status != FrameStatus::kMissing)
    frame.image = {pixels, s.config.width_px, s.config.height_px, s.config.row_bytes(), s.config.format};
}

void CameraSource::count_frame(CameraFrame& frame) {
  CameraCounters& c = state_->own;
  switch (frame.info.status) {
    case FrameStatus::kComplete: ++c.received; return;
    case FrameStatus::kPartial: ++c.incomplete; return;
    case FrameStatus::kMissing: ++c.lost_rows_unknown; return;
  }
}

/// The leader never came: which frame this is, and when it was exposed, is not known.
CameraEvent CameraSource::no_leader(ArvBuffer* buffer, std::int64_t arrival_ns) {
  State& s = *state_;
  alive();
  ++s.own.lost_leader;
  CameraFrame frame = make_frame(buffer, s.numbers.next_unknown().seq, arrival_ns);
  frame.info.missing_rows = static_cast<std::uint32_t>(miss_all(frame));
  return frame;
}

CameraEvent CameraSource::wrong_size(ArvBuffer* buffer, std::uint64_t seq) {
  State& s = *state_;
  ++s.own.lost_size_mismatch;
  std::string is = "incomplete, or not an image";
  if (arv_buffer_get_payload_type(buffer) == ARV_BUFFER_PAYLOAD_TYPE_IMAGE && arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS)
    is = std::to_string(arv_buffer_get_image_width(buffer)) + "x" + std::to_string(arv_buffer_get_image_height(buffer)) +
         " format " + std::to_string(arv_buffer_get_image_pixel_format(buffer));
  s.session->recycle(buffer);
  if (++s.wrong_in_a_row >= s.config.watchdog_periods) return lose(LossReason::kWrongSize);
  return CameraFault{make_error(ErrorCode::kInvalid, "camera " + s.config.address + ": frame " + std::to_string(seq),
                                "is " + is + ", expected " + std::to_string(s.config.width_px) + "x" +
                                    std::to_string(s.config.height_px) + " format " +
                                    std::to_string(arv_format(s.config.format)) + " (" + name_of(s.config.format) + ")")};
}

void CameraSource::publish_counters() {
  State& s = *state_;
  if (s.session) s.packets = s.session->packets();
  const std::lock_guard lock(s.mutex);
  s.published = s.own;
  if (s.session) s.published.unexpected += s.session->unexpected();
  s.published.packets = s.packets_before + s.packets;
  s.published.failed_opens = s.supervisor.failed_opens();
}

CameraCounters CameraSource::counters() const {
  const std::lock_guard lock(state_->mutex);
  return state_->published;
}

}  // namespace cyclops
