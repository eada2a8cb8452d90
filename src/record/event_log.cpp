#include "record/event_log.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace cyclops::record {
namespace {

constexpr std::uint32_t kSync = 0xEDA1DA01;
constexpr std::size_t kHead = kEventHeadBytes;

std::uint32_t get32(const std::uint8_t* p) { return std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 | p[3]; }
std::int64_t get64(const std::uint8_t* p) { return static_cast<std::int64_t>(std::uint64_t{get32(p)} << 32 | get32(p + 4)); }
void put32(std::uint8_t* p, std::uint32_t v) {
  for (int i = 0; i < 4; ++i) p[i] = static_cast<std::uint8_t>(v >> (24 - 8 * i));
}
void put64(std::uint8_t* p, std::int64_t v) {
  put32(p, static_cast<std::uint32_t>(static_cast<std::uint64_t>(v) >> 32));
  put32(p + 4, static_cast<std::uint32_t>(v));
}

}  // namespace

std::size_t put_event_head(std::uint8_t* out, std::int64_t number, std::int64_t time_us, const char* channel, std::size_t payload_bytes) {
  const std::size_t channel_bytes = std::strlen(channel);
  CYCLOPS_ASSERT(channel_bytes >= 1 && channel_bytes <= kMaxChannelBytes && payload_bytes <= kMaxPayloadBytes);
  put32(out, kSync);
  put64(out + 4, number);
  put64(out + 12, time_us);
  put32(out + 20, static_cast<std::uint32_t>(channel_bytes));
  put32(out + 24, static_cast<std::uint32_t>(payload_bytes));
  std::memcpy(out + kHead, channel, channel_bytes);
  return kHead + channel_bytes;
}

Error EventLog::error(ErrorCode code, std::int64_t at, const std::string& what) const {
  return make_error(code, path_ + ": byte " + std::to_string(at), what);
}

Result<EventLog> EventLog::open(const std::string& path) {
  EventLog log;
  log.path_ = path;
  log.file_.reset(std::fopen(path.c_str(), "rb"));
  if (!log.file_) return make_error(ErrorCode::kNotFound, path, std::strerror(errno));
  struct stat info {};
  if (fstat(fileno(log.file_.get()), &info) != 0 || !S_ISREG(info.st_mode)) return make_error(ErrorCode::kInvalid, path, "is not a file");
  log.size_ = info.st_size;
  return log;
}

Result<bool> EventLog::head(LogEvent& event, std::uint32_t& payload_bytes) {
  std::uint8_t raw[kHead];
  event.offset = at_;
  if (at_ == size_) return false;
  if (size_ - at_ < static_cast<std::int64_t>(kHead) || std::fread(raw, 1, kHead, file_.get()) != kHead)
    return error(ErrorCode::kTruncated, at_, "the file ends inside an event");
  if (get32(raw) != kSync) return error(ErrorCode::kCorrupt, at_, "no event begins here");
  event.number = get64(raw + 4);
  event.time_us = get64(raw + 12);
  const std::uint32_t channel_bytes = get32(raw + 20);
  payload_bytes = get32(raw + 24);
  if (channel_bytes == 0 || channel_bytes > kMaxChannelBytes)
    return error(ErrorCode::kCorrupt, at_, "channel name of " + std::to_string(channel_bytes) + " bytes, expected 1 to 63");
  if (payload_bytes > kMaxPayloadBytes)
    return error(ErrorCode::kCorrupt, at_, "payload of " + std::to_string(payload_bytes) + " bytes, expected at most " + std::to_string(kMaxPayloadBytes));
  if (size_ - at_ < static_cast<std::int64_t>(kHead + channel_bytes) + payload_bytes)
    return error(ErrorCode::kTruncated, at_, "the file ends inside an event");
  event.channel.resize(channel_bytes);
  if (std::fread(event.channel.data(), 1, channel_bytes, file_.get()) != channel_bytes)
    return error(ErrorCode::kIo, at_, "cannot be read");
  at_ += static_cast<std::int64_t>(kHead + channel_bytes);
  return true;
}

Result<bool> EventLog::next(LogEvent& event) {
  std::uint32_t bytes = 0;
  auto more = head(event, bytes);
  if (!more.ok() || !*more) return more;
  event.data.resize(bytes);
  if (std::fread(event.data.data(), 1, bytes, file_.get()) != bytes) return error(ErrorCode::kIo, at_, "cannot be read");
  at_ += bytes;
  return true;
}

Result<bool> EventLog::skim(LogEvent& event, std::uint32_t& bytes) {
  auto more = head(event, bytes);
  if (!more.ok() || !*more) return more;
  CYCLOPS_TRY(seek(at_ + bytes));
  return true;
}

Result<> EventLog::seek(std::int64_t offset) {
  if (offset < 0 || offset > size_ || fseeko(file_.get(), offset, SEEK_SET) != 0) return error(ErrorCode::kInvalid, offset, "is outside the file");
  at_ = offset;
  return Ok{};
}

Result<EventLogWriter> EventLogWriter::create(const std::string& path) {
  EventLogWriter w;
  w.path_ = path;
  w.file_.reset(std::fopen(path.c_str(), "wb"));
  if (!w.file_) return make_error(ErrorCode::kIo, path, std::strerror(errno));
  return w;
}

Result<> EventLogWriter::put(const void* data, std::size_t bytes) {
  if (std::fwrite(data, 1, bytes, file_.get()) != bytes)
    return make_error(errno == ENOSPC ? ErrorCode::kFull : ErrorCode::kIo, path_, std::string("cannot be written: ") + std::strerror(errno));
  bytes_ += static_cast<std::int64_t>(bytes);
  return Ok{};
}

Result<> EventLogWriter::write(std::int64_t time_us, const char* channel, const void* data, std::size_t bytes) {
  std::uint8_t head[kHead + kMaxChannelBytes];
  CYCLOPS_TRY(put(head, put_event_head(head, number_, time_us, channel, bytes)));
  CYCLOPS_TRY(put(data, bytes));
  ++number_;
  return Ok{};
}

Result<> EventLogWriter::close() {
  if (!file_) return Ok{};
  const bool good = std::fflush(file_.get()) == 0 && fsync(fileno(file_.get())) == 0;
  const int why = errno;
  file_.reset();
  if (!good) return make_error(why == ENOSPC ? ErrorCode::kFull : ErrorCode::kIo, path_, std::string("cannot be written: ") + std::strerror(why));
  return Ok{};
}

}  // namespace cyclops::record
