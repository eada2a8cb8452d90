#include "tools/web_door.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace cyclops::tools {
namespace {

void hang_up(int fd) {
  ::shutdown(fd, SHUT_RDWR);
  ::close(fd);
}

/// A connection whose request is there. A write waits for kPatience_s for a reader that takes nothing.
class Connection : public httplib::Stream {
 public:
  explicit Connection(int fd) : fd_(fd) {}
  bool is_readable() const override { return ready(POLLIN); }
  bool is_writable() const override {
    char byte = 0;
    const bool left = ::recv(fd_, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
    return !left && ready(POLLOUT);
  }
  ssize_t read(char* to, size_t size) override { return is_readable() ? ::recv(fd_, to, size, MSG_DONTWAIT) : -1; }
  ssize_t write(const char* from, size_t size) override { return is_writable() ? ::send(fd_, from, size, MSG_NOSIGNAL | MSG_DONTWAIT) : -1; }
  void get_remote_ip_and_port(std::string& ip, int& port) const override { name(::getpeername, ip, port); }
  void get_local_ip_and_port(std::string& ip, int& port) const override { name(::getsockname, ip, port); }
  socket_t socket() const override { return fd_; }

 private:
  [[nodiscard]] bool ready(short what) const {
    pollfd p{fd_, what, 0};
    return ::poll(&p, 1, WebDoor::kPatience_s * 1000) == 1 && (p.revents & what) != 0 && (p.revents & (POLLERR | POLLNVAL)) == 0;
  }
  template <class Ask>
  void name(Ask ask, std::string& ip, int& port) const {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    char text[INET_ADDRSTRLEN] = "";
    if (ask(fd_, reinterpret_cast<sockaddr*>(&address), &size) != 0) return;
    ::inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
    ip = text;
    port = ntohs(address.sin_port);
  }
  int fd_;
};

/// What httplib would give to a thread is taken at once, in the thread that accepts.
struct AtOnce : httplib::TaskQueue {
  void enqueue(std::function<void()> take) override { take(); }
  void shutdown() override {}
};

}  // namespace

WebDoor::WebDoor(std::size_t threads) : pool_(threads), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  CYCLOPS_ASSERT(wake_ >= 0);
  new_task_queue = [] { return new AtOnce; };
  watcher_ = std::thread([this] { watch(); });
}

WebDoor::~WebDoor() { close(); }

void WebDoor::close() {
  if (!watcher_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wake();
  watcher_.join();
  pool_.shutdown();
  for (const Waiting& w : waiting_) hang_up(w.fd);
  ::close(wake_);
}

void WebDoor::wake() const {
  const std::uint64_t one = 1;
  (void)!::write(wake_, &one, sizeof one);
}

bool WebDoor::process_and_close_socket(socket_t fd) {
  const int room = kAnswer;
  ::setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
  switch (look(fd)) {
    case Head::kWhole: dispatch(fd); return true;
    case Head::kGone: hang_up(fd); return false;
    case Head::kPart: break;
  }
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == kWaiting) {
    hang_up(waiting_.front().fd);
    waiting_.erase(waiting_.begin());
  }
  waiting_.push_back({fd, steady_now_ns() + kPatience_s * std::int64_t{1'000'000'000}});
  wake();
  return true;
}

/// Without taking it away. A head that is not whole is looked at again when more of it is there.
WebDoor::Head WebDoor::look(int fd) {
  std::array<char, kHead> head;
  const ssize_t n = ::recv(fd, head.data(), head.size(), MSG_PEEK | MSG_DONTWAIT);
  if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) return Head::kGone;
  const std::string_view text(head.data(), static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
  if (text.find("\r\n\r\n") != std::string_view::npos) return Head::kWhole;
  pollfd p{fd, POLLRDHUP, 0};
  if (text.size() == kHead || ::poll(&p, 1, 0) != 0) return Head::kGone;   // it never becomes whole
  const int more = static_cast<int>(text.size()) + 1;
  ::setsockopt(fd, SOL_SOCKET, SO_RCVLOWAT, &more, sizeof more);
  return Head::kPart;
}

void WebDoor::dispatch(int fd) {
  if (++queued_ > kQueued) {
    --queued_;
    return hang_up(fd);
  }
  const int any = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_RCVLOWAT, &any, sizeof any);
  pool_.enqueue([this, fd] { serve(fd); });
}

void WebDoor::serve(int fd) {
  --queued_;
  Connection connection(fd);
  bool closed = false;
  process_request(connection, true, closed, nullptr);
  hang_up(fd);
}

void WebDoor::watch() {
  std::vector<pollfd> polled;
  for (;;) {
    polled.assign(1, {wake_, POLLIN, 0});
    int timeout_ms = -1;
    {
      const std::lock_guard lock(mutex_);
      if (closing_) return;
      for (const Waiting& w : waiting_) polled.push_back({w.fd, POLLIN, 0});
      if (!waiting_.empty()) timeout_ms = static_cast<int>(std::max<std::int64_t>(0, (waiting_.front().until_ns - steady_now_ns()) / 1'000'000)) + 1;
    }
    (void)::poll(polled.data(), polled.size(), timeout_ms);
    std::uint64_t count = 0;
    (void)!::read(wake_, &count, sizeof count);
    const std::int64_t now_ns = steady_now_ns();
    const std::lock_guard lock(mutex_);
    std::erase_if(waiting_, [&](const Waiting& w) {
      const Head head = look(w.fd);
      if (head == Head::kPart && now_ns < w.until_ns) return false;
      if (head == Head::kWhole) dispatch(w.fd);
      else hang_up(w.fd);
      return true;
    });
  }
}

}  // namespace cyclops::tools
