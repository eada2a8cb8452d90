#include "record/event_buffer.hpp"

#include <cstring>

namespace cyclops::record {

bool EventBuffer::append(std::int64_t time_us, const char* channel, const void* data, std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  const std::int64_t number = number_++;
  if (filling_.size() - used_ < kEventHeadBytes + kMaxChannelBytes + bytes) {
    ++refused_;
    return false;
  }
  used_ += put_event_head(filling_.data() + used_, number, time_us, channel, bytes);
  if (bytes != 0) std::memcpy(filling_.data() + used_, data, bytes);
  used_ += bytes;
  ++events_;
  return true;
}

EventBuffer::Piece EventBuffer::take() {
  const std::lock_guard lock(mutex_);
  filling_.swap(writing_);
  const Piece out{{writing_.data(), used_}, events_};
  used_ = 0;
  events_ = 0;
  return out;
}

}  // namespace cyclops::record
