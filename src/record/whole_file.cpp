#include "record/whole_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace cyclops::record {

std::string quoted(const std::string& s) {
  std::string out = "\"";
  for (char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}

Result<> write_whole(const std::string& path, const std::string& content) {
  const std::string part = path + ".part";
  const int fd = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) return make_error(ErrorCode::kIo, part, std::strerror(errno));
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t n = ::write(fd, content.data() + done, content.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  const bool good = done == content.size() && ::fsync(fd) == 0;
  const int why = errno;
  ::close(fd);
  if (!good) return make_error(why == ENOSPC ? ErrorCode::kFull : ErrorCode::kIo, part, std::string("cannot be written: ") + std::strerror(why));
  if (std::rename(part.c_str(), path.c_str()) != 0) return make_error(ErrorCode::kIo, path, std::strerror(errno));
  return Ok{};
}

Result<> to_disk(const std::string& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return make_error(ErrorCode::kIo, folder, std::strerror(errno));
  const bool good = ::fsync(fd) == 0 || errno == EINVAL;  // EINVAL: a file system that needs none
  const int why = errno;
  ::close(fd);
  if (!good) return make_error(ErrorCode::kIo, folder, std::string("cannot be brought to the disk: ") + std::strerror(why));
  return Ok{};
}

}  // namespace cyclops::record
