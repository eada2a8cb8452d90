#include "service/sink.hpp"

#include <lcm/lcm.h>

namespace cyclops {

bool LcmSink::put(Time, const char* channel, const void* data, std::size_t bytes) {
  return lcm_publish(lcm_, channel, data, static_cast<unsigned>(bytes)) == 0;
}

bool LogSink::put(Time t, const char* channel, const void* data, std::size_t bytes) {
  const auto done = log_.write(t.ns / 1000, channel, data, bytes);
  if (!done.ok() && failed_.empty()) failed_ = done.error().message();
  return done.ok();
}

}  // namespace cyclops
