#pragma once
/// New folders out of old ones: a clean one out of one that was cut off, and a shorter one. The old one is only read.
#include <string>

#include "base/result.hpp"

namespace cyclops::tools {

struct Copied {
  std::int64_t frames{0};            ///< FRAME messages
  std::int64_t pixels{0};            ///< frames with their pixels
  std::int64_t inputs{0};            ///< all messages of messages.lcm
  std::int64_t published{0};
};

/// Every whole event of a sortie that was not finished or is damaged, sealed anew; frames whose checksum is wrong are left out.
/// Errors: `out` is there already; what cannot be read or written.
Result<Copied> recover_sortie(const std::string& folder, const std::string& out);

/// The frames from `from_s` to before `to_s`, counted from the first frame's arrival, as a flight of its own: the camera starts
/// with the first of them, which gets number 1; TSPI from 2 s before, and the time mark that held then.
Result<Copied> cut_flight(const std::string& folder, const std::string& out, double from_s, double to_s);

}  // namespace cyclops::tools
