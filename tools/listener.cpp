#include "tools/listener.hpp"

#include <poll.h>
#include <sys/resource.h>

#include "wire/channels.hpp"

namespace cyclops::tools {

void limit_memory(std::size_t bytes) {
  const rlimit limit{bytes, bytes};
  (void)::setrlimit(RLIMIT_AS, &limit);
}

Result<std::unique_ptr<Listener>> Listener::open(const std::string& url, Taker taker) {
  lcm_t* lcm = lcm_create(url.empty() ? nullptr : url.c_str());
  if (lcm == nullptr) return make_error(ErrorCode::kIo, "lcm " + url, "cannot be opened: is the URL right, and is multicast routed?");
  std::unique_ptr<Listener> self(new Listener(lcm, std::move(taker)));
  for (const char* name : {channel::kHealth, channel::kClock, channel::kEvent, channel::kFrame, channel::kPrediction, channel::kTrack, channel::kMeasurement})
    lcm_subscription_set_queue_capacity(lcm_subscribe(lcm, name, on_message, self.get()), 64);
  return self;
}

Listener::~Listener() { lcm_destroy(lcm_); }

bool Listener::wait(int timeout_ms) {
  pollfd p{lcm_get_fileno(lcm_), POLLIN, 0};
  return ::poll(&p, 1, timeout_ms) > 0;
}

void Listener::handle() {
  constexpr int kMost = 500;         // a flood must not keep the caller from drawing
  for (int i = 0; i < kMost && lcm_handle_timeout(lcm_, 0) > 0; ++i) {}
}

void Listener::on_message(const lcm_recv_buf_t* buffer, const char* name, void* self) {
  static_cast<Listener*>(self)->taker_(name, buffer->data, buffer->data_size);
}

}  // namespace cyclops::tools
