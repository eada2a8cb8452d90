#pragma once
/// What can happen to the file system that a folder is on. It must be one that was mounted for the test: everything on it is hit.
///
/// Needs    root, or the rights of the owner of the mount's user namespace.
/// Errors   kIo with the folder and the reason of the system; kUnsupported where the file system cannot do it.
#include <cstdint>
#include <string>

#include "base/result.hpp"

namespace cyclops::hil::disk {

/// Every write blocks until it is thawed; as a card or a disk that stalls. Reads go on. tmpfs cannot be frozen.
[[nodiscard]] Result<> freeze(const std::string& folder);
void thaw(const std::string& folder);

/// Takes all room that is left, with a file of its own; returns its bytes.
[[nodiscard]] Result<std::uint64_t> fill(const std::string& folder);
void free(const std::string& folder);

/// ext4: the kernel's own reaction to a bad sector, with files open (mount with errors=remount-ro). Others: remounted read-only,
/// which fails while a file is open for writing.
[[nodiscard]] Result<> make_read_only(const std::string& folder);
void make_writable(const std::string& folder);

}  // namespace cyclops::hil::disk
