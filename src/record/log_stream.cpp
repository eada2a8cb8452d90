#include "record/log_stream.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "record/event_log.hpp"
#include "wire/codec.hpp"

namespace cyclops::record {
namespace {

constexpr std::int64_t kFlow = std::int64_t{8} << 20;   // bytes after which the kernel is told to begin writing

}  // namespace

std::string part_name(const std::string& name, int part) {
  if (part == 0) return name + ".lcm";
  char number[24];
  std::snprintf(number, sizeof number, ".%03d.lcm", part);
  return name + number;
}

Error LogStream::error(int why) const {
  const bool full = why == ENOSPC || why == EDQUOT || why == EFBIG;
  return make_error(full ? ErrorCode::kFull : ErrorCode::kIo, config_.folder + "/" + file_, std::string("cannot be written: ") + std::strerror(why));
}

Result<std::unique_ptr<LogStream>> LogStream::create(const LogStreamConfig& config) {
  std::unique_ptr<LogStream> out(new LogStream(config));
  out->sum_.reset(XXH3_createState());
  CYCLOPS_TRY(out->open(Time{}));
  return out;
}

LogStream::~LogStream() {
  if (fd_ >= 0) ::close(fd_);
}

Result<> LogStream::open(Time now) {
  file_ = part_name(config_.name, part_);
  const int fd = ::open((config_.folder + "/" + file_).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd < 0) return error(errno);
  if (const int folder = ::open(config_.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); folder >= 0) {
    (void)::fsync(folder);  // or the name may be gone after a loss of power
    ::close(folder);
  }
  const std::lock_guard lock(fd_mutex_);
  if (fd_ >= 0) {
    (void)::fdatasync(fd_);
    ::close(fd_);
  }
  fd_ = fd;
  at_ = flowing_ = sealed_ = seal_end_ = 0;
  files_[file_] = 0;
  opened_ = now;
  XXH3_64bits_reset(sum_.get());
  return Ok{};
}

Result<> LogStream::put(std::initializer_list<Bytes> pieces) {
  std::array<iovec, 4> left{};
  std::size_t n = 0, all = 0;
  CYCLOPS_ASSERT(pieces.size() <= left.size());
  for (const Bytes& p : pieces)
    if (!p.empty()) {
      left[n++] = {const_cast<std::uint8_t*>(p.data()), p.size()};
      all += p.size();
    }
  for (std::size_t first = 0; first < n;) {
    const ssize_t done = config_.write(fd_, left.data() + first, static_cast<int>(n - first));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      const int why = done < 0 ? errno : ENOSPC;
      if (::ftruncate(fd_, at_) == 0) (void)::lseek(fd_, at_, SEEK_SET);
      return error(why);
    }
    auto gone = static_cast<std::size_t>(done);
    while (first < n && gone >= left[first].iov_len) gone -= left[first++].iov_len;
    if (first < n) {
      left[first].iov_base = static_cast<std::uint8_t*>(left[first].iov_base) + gone;
      left[first].iov_len -= gone;
    }
  }
  at_ += static_cast<std::int64_t>(all);
  total_ += static_cast<std::int64_t>(all);
  files_[file_] = at_;
  return Ok{};
}

Result<> LogStream::write(Time now, std::initializer_list<Bytes> pieces) {
  if (opened_.ns == 0) opened_ = now;
  if (at_ > 0 && (at_ >= config_.split_bytes || now - opened_ >= config_.split_time)) {
    CYCLOPS_TRY(put_seal(now));
    ++part_;
    if (const auto opened = open(now); !opened.ok()) {
      --part_;
      file_ = part_name(config_.name, part_);
      return opened.error();
    }
  }
  CYCLOPS_TRY(put(pieces));
  for (const Bytes& p : pieces) XXH3_64bits_update(sum_.get(), p.data(), p.size());
  if (at_ - flowing_ >= kFlow) {
    (void)::sync_file_range(fd_, flowing_, at_ - flowing_, SYNC_FILE_RANGE_WRITE);
    flowing_ = at_;
  }
  if (at_ - sealed_ >= config_.seal_bytes) (void)put_seal(now).ok();  // one that fails comes with the next
  return Ok{};
}

Result<> LogStream::put_seal(Time now) {
  if (at_ == seal_end_) return Ok{};
  seal_t seal;
  fill(seal, Seal{sealed_, at_, XXH3_64bits_digest(sum_.get())});
  std::array<std::uint8_t, 64> payload;
  const Encoded bytes = encode_into(seal, payload);
  std::array<std::uint8_t, kEventHeadBytes + kMaxChannelBytes> head;
  const std::size_t n = put_event_head(head.data(), seals_, now.ns / 1000, channel::kSeal, bytes.size);
  CYCLOPS_TRY(put({{head.data(), n}, {bytes.data, bytes.size}}));
  ++seals_;
  sealed_ = at_ - static_cast<std::int64_t>(n + bytes.size);
  seal_end_ = at_;
  XXH3_64bits_reset(sum_.get());
  XXH3_64bits_update(sum_.get(), head.data(), n);  // the next one covers this one
  XXH3_64bits_update(sum_.get(), bytes.data, bytes.size);
  return Ok{};
}

Result<> LogStream::seal(Time now) { return put_seal(now); }

Result<> LogStream::sync() {
  int fd = -1;
  {
    const std::lock_guard lock(fd_mutex_);
    fd = fd_ >= 0 ? ::fcntl(fd_, F_DUPFD_CLOEXEC, 0) : -1;
  }
  if (fd < 0) return Ok{};
  const bool good = ::fdatasync(fd) == 0;
  const int why = errno;
  (void)::posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);  // nobody reads it soon; the pages are the disk's buffer, not a cache
  ::close(fd);
  if (!good) return make_error(why == ENOSPC ? ErrorCode::kFull : ErrorCode::kIo, config_.folder + "/" + config_.name, std::string("cannot be brought to the disk: ") + std::strerror(why));
  return Ok{};
}

Result<> LogStream::close(Time now) {
  CYCLOPS_TRY(put_seal(now));
  CYCLOPS_TRY(sync());
  const std::lock_guard lock(fd_mutex_);
  ::close(fd_);
  fd_ = -1;
  return Ok{};
}

}  // namespace cyclops::record
