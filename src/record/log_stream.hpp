#pragma once
/// One log of a sortie as it grows on the disk: LCM event logs, split by size and time, sealed with checksums.
///
///   NAME.lcm, NAME.001.lcm, NAME.002.lcm ...    cut only between events
///
/// Seals    an event on SEAL after each write() of at least `seal_bytes`, and with each seal(): XXH3 of what came since the
///          seal before, and of that one. What follows the last seal was not finished.
/// Failure  a write that fails leaves no part of its events behind: the file is cut back to the last whole event, and the next
///          write() tries again. kFull: no room; kIo: anything else.
/// Threads  one writes; sync() may be called by another.
#include <xxhash.h>

#include <sys/uio.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "base/time.hpp"

namespace cyclops::record {

struct LogStreamConfig {
  std::string folder;
  std::string name;                                   ///< without ".lcm"
  std::int64_t split_bytes{std::int64_t{4} << 30};
  Duration split_time{Duration::from_seconds(1800)};
  std::int64_t seal_bytes{std::int64_t{64} << 10};
  std::function<ssize_t(int, const iovec*, int)> write{::writev};  ///< a test's disk may be slow or full
};

class LogStream {
 public:
  using Bytes = std::span<const std::uint8_t>;
  /// The file must not be there yet.
  static Result<std::unique_ptr<LogStream>> create(const LogStreamConfig& config);
  ~LogStream();
  LogStream(const LogStream&) = delete;
  LogStream& operator=(const LogStream&) = delete;

  /// Whole events in up to four pieces. `now`: any clock that goes on, for splitting.
  Result<> write(Time now, std::initializer_list<Bytes> pieces);
  Result<> seal(Time now);
  /// Everything written so far is on the disk when it returns.
  Result<> sync();
  /// Seals and syncs; nothing may be written any more.
  Result<> close(Time now);

  [[nodiscard]] std::int64_t bytes() const { return total_; }     ///< in all files
  [[nodiscard]] const std::map<std::string, std::int64_t>& files() const { return files_; }   ///< name, bytes; of the writing thread

 private:
  explicit LogStream(const LogStreamConfig& config) : config_(config) {}
  Result<> open(Time now);
  Result<> put(std::initializer_list<Bytes> pieces);
  Result<> put_seal(Time now);
  [[nodiscard]] Error error(int why) const;

  struct Unstate { void operator()(XXH3_state_t* s) const { XXH3_freeState(s); } };
  LogStreamConfig config_;
  int part_{0};
  int fd_{-1};
  std::mutex fd_mutex_;                // between a split and sync()
  std::string file_;
  std::int64_t at_{0};                 // end of the last whole event
  std::int64_t flowing_{0};            // up to here the kernel was told to begin writing
  std::int64_t sealed_{0};             // the next seal covers from here
  std::int64_t seal_end_{0};
  std::int64_t seals_{0};
  std::int64_t total_{0};
  Time opened_{};
  std::unique_ptr<XXH3_state_t, Unstate> sum_;
  std::map<std::string, std::int64_t> files_;
};

/// NAME.lcm for part 0, NAME.001.lcm for part 1 ...
[[nodiscard]] std::string part_name(const std::string& name, int part);

}  // namespace cyclops::record
