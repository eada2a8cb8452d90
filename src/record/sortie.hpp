#pragma once
/// The folder of a recorded flight while it is being flown, and what was known when it began (docs/recording.md).
///
///   sortie.toml     written first: who recorded, with what, from when
///   rig.toml ...    the rig as it was loaded, with the files it names; profile.toml when one was given
///   messages.lcm    inputs in the order in which they were used: the same channels as in any flight, and ACQUISITION
///   published.lcm   everything the service said
///   frames.lcm      exact pixels
///   manifest.toml   written last: from then on the folder is a flight
/// Errors name the file. Threads: any.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "base/time.hpp"

namespace cyclops::record {

inline constexpr const char* kSortieFormat = "cyclops-sortie-1";
inline constexpr const char* kInputs = "messages";
inline constexpr const char* kPublished = "published";
inline constexpr const char* kFrames = "frames";

struct SortieHead {
  std::string name;
  std::string version;                   ///< of the service
  std::string program_sha256;
  std::string profile;                   ///< its name
  std::string started_utc;               ///< ISO 8601
  std::int64_t started_monotonic_ns{0};  ///< CLOCK_MONOTONIC at that moment, and
  std::int64_t started_realtime_ns{0};   ///< CLOCK_REALTIME: since 1970, ns
  bool own_clock{false};                 ///< the service clock is that of a bench, not CLOCK_MONOTONIC of this host
  std::map<std::string, std::string> sha256;  ///< of the files written at the start
};

struct SortieFile {
  std::string name;
  std::string content;
};

/// Makes `folder`, which must not be there yet, with `files` and sortie.toml in it; fills head.sha256.
Result<> begin_sortie(const std::string& folder, SortieHead& head, const std::vector<SortieFile>& files);
Result<SortieHead> read_sortie(const std::string& folder);
[[nodiscard]] std::string sha256(const std::string& bytes);

}  // namespace cyclops::record
