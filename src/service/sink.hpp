#pragma once
/// Where encoded messages go: the LCM network, or an event log.
#include <cstddef>
#include <memory>
#include <string>

#include "base/result.hpp"
#include "base/time.hpp"
#include "record/event_log.hpp"

struct _lcm_t;

namespace cyclops {

class MessageSink {
 public:
  virtual ~MessageSink() = default;
  /// `t` is only kept by logs. False: not delivered; the caller counts.
  virtual bool put(Time t, const char* channel, const void* data, std::size_t bytes) = 0;
};

class LcmSink : public MessageSink {
 public:
  explicit LcmSink(_lcm_t* lcm) : lcm_(lcm) {}   ///< not owned
  bool put(Time t, const char* channel, const void* data, std::size_t bytes) override;

 private:
  _lcm_t* lcm_;
};

class LogSink : public MessageSink {
 public:
  explicit LogSink(record::EventLogWriter log) : log_(std::move(log)) {}
  bool put(Time t, const char* channel, const void* data, std::size_t bytes) override;
  Result<> close() { return failed_.empty() ? log_.close() : Result<>(make_error(ErrorCode::kIo, "", failed_)); }

 private:
  record::EventLogWriter log_;
  std::string failed_;
};

}  // namespace cyclops
