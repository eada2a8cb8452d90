#pragma once
/// Whole files as text. Errors: kNotFound when it cannot be opened, kIo when it cannot be read; both name the path.
#include <string>

#include "base/result.hpp"

namespace cyclops {

[[nodiscard]] Result<std::string> read_file(const std::string& path);

}  // namespace cyclops
