#pragma once
/// LCM event logs: what lcm-logger writes and lcm-logplayer reads, with every length checked before it is believed.
///
/// Layout   per event, big endian: sync 0xEDA1DA01, event number i64, time i64 (us), channel bytes u32, payload bytes u32,
///          channel, payload. Source: LCM's log file format.
/// Errors   kCorrupt and kTruncated name the file and the byte. A reader stops there; what came before is good.
/// Threads  one at a time.
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace cyclops::record {

inline constexpr std::uint32_t kMaxChannelBytes = 63;             ///< LCM's own limit
inline constexpr std::uint32_t kMaxPayloadBytes = 40U << 20;      ///< 4096 x 4096 pixels of 2 bytes, and a header

inline constexpr std::size_t kEventHeadBytes = 28;

/// The bytes in front of a payload: head and channel name. `out` has room for kEventHeadBytes + kMaxChannelBytes; returns
/// how many were written.
std::size_t put_event_head(std::uint8_t* out, std::int64_t number, std::int64_t time_us, const char* channel, std::size_t payload_bytes);

struct LogEvent {
  std::int64_t number{0};
  std::int64_t time_us{0};
  std::int64_t offset{0};            ///< of the event in the file, bytes
  std::string channel;
  std::vector<std::uint8_t> data;
};

class EventLog {
 public:
  static Result<EventLog> open(const std::string& path);
  /// False at the end of the file. `event` keeps its memory from call to call.
  Result<bool> next(LogEvent& event);
  /// As next, without the payload: `data` is left alone and its size comes in `payload_bytes`.
  Result<bool> skim(LogEvent& event, std::uint32_t& payload_bytes);
  Result<> seek(std::int64_t offset);
  [[nodiscard]] std::int64_t size() const { return size_; }

 private:
  struct Close { void operator()(std::FILE* f) const { std::fclose(f); } };
  Result<bool> head(LogEvent& event, std::uint32_t& payload_bytes);
  [[nodiscard]] Error error(ErrorCode code, std::int64_t at, const std::string& what) const;
  std::unique_ptr<std::FILE, Close> file_;
  std::string path_;
  std::int64_t size_{0};
  std::int64_t at_{0};
};

class EventLogWriter {
 public:
  static Result<EventLogWriter> create(const std::string& path);
  /// Event numbers count up from 0. Error kFull when the disk is.
  Result<> write(std::int64_t time_us, const char* channel, const void* data, std::size_t bytes);
  Result<> close();                  ///< flushed to the disk; an error here means that the file is not whole
  [[nodiscard]] std::int64_t events() const { return number_; }
  [[nodiscard]] std::int64_t bytes() const { return bytes_; }

 private:
  struct Close { void operator()(std::FILE* f) const { std::fclose(f); } };
  Result<> put(const void* data, std::size_t bytes);
  std::unique_ptr<std::FILE, Close> file_;
  std::string path_;
  std::int64_t number_{0};
  std::int64_t bytes_{0};
};

}  // namespace cyclops::record
