#include "base/file.hpp"

#include <fstream>
#include <sstream>

namespace cyclops {

Result<std::string> read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return make_error(ErrorCode::kNotFound, path, "cannot be opened");
  std::ostringstream text;
  if (in.peek() != std::ifstream::traits_type::eof()) text << in.rdbuf();
  if (in.bad() || !text) return make_error(ErrorCode::kIo, path, "cannot be read");
  return text.str();
}

}  // namespace cyclops
