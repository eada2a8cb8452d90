#include "hil/fault_disk.hpp"

#include <fcntl.h>
#include <linux/fs.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "capture/fd.hpp"

namespace cyclops::hil::disk {
namespace {

const char* const kFill = "/fault-fill";

Error failed(const std::string& folder, const std::string& what) {
  const ErrorCode code = errno == EOPNOTSUPP || errno == ENOTTY ? ErrorCode::kUnsupported : ErrorCode::kIo;
  return make_error(code, folder, what + ": " + std::strerror(errno));
}

Fd opened(const std::string& folder) { return Fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)); }

/// Only a mount of its own: never the disk that the rest of the machine lives on.
Result<> check_own_mount(const std::string& folder) {
  struct stat here{}, root{};
  if (::stat(folder.c_str(), &here) != 0) return failed(folder, "stat");
  if (::stat("/", &root) == 0 && here.st_dev == root.st_dev)
    return make_error(ErrorCode::kInvalid, folder, "is on the root file system, expected one mounted for the test");
  return Ok{};
}

/// /sys/fs/ext4/NAME/trigger_fs_error of the folder's device; empty when it is no ext4.
std::string error_trigger(const std::string& folder) {
  struct stat s{};
  if (::stat(folder.c_str(), &s) != 0) return {};
  std::error_code none;
  const auto link = std::filesystem::read_symlink("/sys/dev/block/" + std::to_string(major(s.st_dev)) + ":" + std::to_string(minor(s.st_dev)), none);
  const std::string path = "/sys/fs/ext4/" + link.filename().string() + "/trigger_fs_error";
  return !none && std::filesystem::exists(path, none) ? path : std::string();
}

}  // namespace

Result<> freeze(const std::string& folder) {
  CYCLOPS_TRY(check_own_mount(folder));
  const Fd fd = opened(folder);
  if (!fd.open()) return failed(folder, "open");
  if (::ioctl(fd.get(), FIFREEZE, 0) != 0) return failed(folder, "freeze");
  return Ok{};
}

void thaw(const std::string& folder) {
  const Fd fd = opened(folder);
  if (fd.open()) (void)::ioctl(fd.get(), FITHAW, 0);
}

Result<std::uint64_t> fill(const std::string& folder) {
  CYCLOPS_TRY(check_own_mount(folder));
  const Fd fd(::open((folder + kFill).c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
  if (!fd.open()) return failed(folder, "open");
  off_t size = 0;
  for (off_t step = 64 << 20; step >= 4096;)
    if (::fallocate(fd.get(), 0, size, step) == 0) size += step;
    else if (errno == ENOSPC) step /= 2;
    else return failed(folder, "fallocate");
  return static_cast<std::uint64_t>(size);
}

void free(const std::string& folder) { (void)::unlink((folder + kFill).c_str()); }

Result<> make_read_only(const std::string& folder) {
  CYCLOPS_TRY(check_own_mount(folder));
  if (const std::string trigger = error_trigger(folder); !trigger.empty()) {
    const Fd fd(::open(trigger.c_str(), O_WRONLY | O_CLOEXEC));
    constexpr char kWhy[] = "fault script";
    if (fd.open() && ::write(fd.get(), kWhy, sizeof kWhy - 1) > 0) return Ok{};
    return failed(folder, trigger);
  }
  if (::mount(nullptr, folder.c_str(), nullptr, MS_REMOUNT | MS_RDONLY, nullptr) != 0) return failed(folder, "remount read-only");
  return Ok{};
}

void make_writable(const std::string& folder) { (void)::mount(nullptr, folder.c_str(), nullptr, MS_REMOUNT, nullptr); }

}  // namespace cyclops::hil::disk
