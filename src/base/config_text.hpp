#pragma once
/// TOML text as toml++ can be trusted with: ASCII without control characters.
///
/// toml++ 3.3 runs into undefined behaviour (a marker of unreachable code that is reached) on other characters wherever its parser looks for
/// something else, and that need not be where they seem to be: after 0" it is not within a string. So in comments they become '?', in strings
/// with double quotes the escapes that mean them; lines stay where they are.
/// Errors   control characters; other characters elsewhere, in 'literal' strings too, which know no escapes; what is no UTF-8: with the line.
/// Threads  any.
#include <string>

#include "base/result.hpp"

namespace cyclops {

Result<std::string> ascii_text(const std::string& original, const std::string& name);

}  // namespace cyclops
