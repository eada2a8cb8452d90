#pragma once
/// Small files that are there whole or not at all, even after a loss of power. Threads: any.
#include <string>

#include "base/result.hpp"

namespace cyclops::record {

/// A TOML string: quotes and backslashes escaped, control characters as blanks.
[[nodiscard]] std::string quoted(const std::string& s);
/// Writes beside the file, brings it to the disk, then gives it its name.
Result<> write_whole(const std::string& path, const std::string& content);
/// The names in a folder survive a loss of power only when the folder itself has been brought to the disk.
Result<> to_disk(const std::string& folder);

}  // namespace cyclops::record
