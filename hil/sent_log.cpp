#include "hil/sent_log.hpp"

#include <cerrno>
#include <cinttypes>
#include <cstring>

namespace cyclops::hil {

Result<> SentLog::open(const std::string& path) {
  if (path.empty()) return Ok{};
  path_ = path;
  file_.reset(std::fopen(path.c_str(), "w"));
  if (!file_) return make_error(ErrorCode::kIo, path, std::string("cannot be written: ") + std::strerror(errno));
  std::fputs("block_id,tick_ns,flight_id,shift_ns,acquisition,sent,host_ns\n", file_.get());
  return Ok{};
}

void SentLog::add(const SentFrame& f) {
  if (!file_) return;
  std::fprintf(file_.get(), "%" PRIu64 ",%" PRId64 ",%" PRId64 ",%" PRId64 ",%" PRIu32 ",%d,%" PRId64 "\n", f.block_id, f.tick_ns, f.flight_id, f.shift_ns, f.acquisition,
               f.sent ? 1 : 0, f.host_ns);
}

Result<> SentLog::finish() {
  if (!file_) return Ok{};
  if (std::fclose(file_.release()) != 0) return make_error(ErrorCode::kIo, path_, std::string("cannot be written: ") + std::strerror(errno));
  return Ok{};
}

}  // namespace cyclops::hil
