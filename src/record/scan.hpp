#pragma once
/// Reads one log file from end to end and says what in it can be believed, whatever happened to it.
///
/// Where no event begins, the next one is searched for by its sync word; the bytes in between are reported. Pieces that a seal
/// covers are compared with its checksum. Nothing is changed.
/// Errors  only a file that cannot be opened. Threads: any.
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "record/event_log.hpp"

namespace cyclops::record {

struct Range {
  std::int64_t from{0};
  std::int64_t to{0};                    ///< first one that is not in it
};

struct ChannelScan {
  std::int64_t events{0};
  std::int64_t bytes{0};
  std::int64_t first_us{0}, last_us{0};
};

struct LogScan {
  std::string path;
  std::int64_t bytes{0};
  std::int64_t events{0};                ///< seals not counted
  std::int64_t first_us{0}, last_us{0};
  std::int64_t seals{0};
  std::int64_t sealed_to{0};             ///< end of what the last seal covers
  std::int64_t tail_bytes{0};            ///< of an event that the file ends in
  std::vector<Range> unreadable;         ///< bytes in which no event begins
  std::vector<Range> damaged;            ///< bytes that do not have the checksum of their seal
  std::map<std::string, ChannelScan> channels;
};

/// `see`: each event but the seals, before its seal has been checked; may be empty.
Result<LogScan> scan_log(const std::string& path, const std::function<void(const LogEvent&)>& see);

}  // namespace cyclops::record
