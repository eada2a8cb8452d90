#include "tools/web_server.hpp"

#include <atomic>
#include <chrono>
#include <thread>

#include "base/clock.hpp"
#include "tools/web_door.hpp"

namespace cyclops::tools {
namespace {

// /events and /history may hold a thread as long as their readers like; all else is shorter than what a socket takes at once.
constexpr int kMostHistories = 4;
constexpr int kThreads = WebServer::kMostViewers + kMostHistories + 4;
constexpr int kAlive_ms = 1000;

std::string event(const char* name, const std::string& data) { return std::string("event: ") + name + "\ndata: " + data + "\n\n"; }

/// One of a limited number, until it dies.
struct Place {
  explicit Place(std::atomic<int>& n) : count(n) {}
  ~Place() { --count; }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  std::atomic<int>& count;
};

/// One viewer of /events: what it has seen.
struct Viewer : Place {
  using Place::Place;
  std::uint64_t health{0}, frame{0};
};

bool send_news(WebFeed& feed, Viewer& viewer, httplib::DataSink& sink) {
  const WebFeed::News news = feed.wait(viewer.health, viewer.frame, kAlive_ms);
  if (news.stopped) return false;
  viewer.health = news.health_number;
  viewer.frame = news.frame_number;
  std::string text;
  if (news.health) text += event("health", *news.health);
  if (news.frame) text += event("frame", *news.frame);
  if (text.empty()) text = event("alive", "{}");
  return sink.write(text.data(), text.size());
}

bool take_place(std::atomic<int>& count, int most, httplib::Response& out) {
  if (++count <= most) return true;
  --count;
  out.status = 503;
  out.set_content("too many viewers\n", "text/plain");
  return false;
}

}  // namespace

struct WebServer::State {
  explicit State(WebFeed& f) : feed(f) {}
  void set_limits();
  void set_routes();
  void answer_events(httplib::Response& out);
  void answer_history(httplib::Response& out);
  [[nodiscard]] httplib::Server::HandlerResponse admit(const httplib::Request& in, httplib::Response& out) const;
  [[nodiscard]] bool own_host(const std::string& host) const {
    const std::size_t colon = host.rfind(':');
    if (colon == std::string::npos || host.substr(colon + 1) != std::to_string(port)) return false;
    return host.substr(0, colon) == "127.0.0.1" || host.substr(0, colon) == "localhost";
  }

  WebFeed& feed;
  int port{0};
  std::atomic<int> viewers{0}, histories{0};
  WebDoor server{kThreads};
  std::thread thread;
};

httplib::Server::HandlerResponse WebServer::State::admit(const httplib::Request& in, httplib::Response& out) const {
  const auto refuse = [&](int status, const char* why) {
    out.status = status;
    out.set_content(why, "text/plain");
    return httplib::Server::HandlerResponse::Handled;
  };
  if (in.method != "GET" && in.method != "HEAD") return refuse(405, "read-only\n");
  if (in.get_header_value_count("Host") != 1 || !own_host(in.get_header_value("Host"))) return refuse(403, "this page is for 127.0.0.1 only\n");
  if (in.has_header("Origin") && in.get_header_value("Origin") != "http://" + in.get_header_value("Host")) return refuse(403, "foreign origin\n");
  return httplib::Server::HandlerResponse::Unhandled;
}

void WebServer::State::set_limits() {
  server.set_payload_max_length(0);
  server.set_tcp_nodelay(true);
  server.set_socket_options([](socket_t s) {   // not the library's SO_REUSEPORT: a second server must fail, not share
    const int yes = 1;
    ::setsockopt(s, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server.set_default_headers({{"Content-Security-Policy", web_policy(web_page())}, {"X-Content-Type-Options", "nosniff"}, {"X-Frame-Options", "DENY"},
                              {"Referrer-Policy", "no-referrer"}, {"Cross-Origin-Resource-Policy", "same-origin"}, {"Cache-Control", "no-store"}});
}

void WebServer::State::answer_events(httplib::Response& out) {
  if (!take_place(viewers, kMostViewers, out)) return;
  auto viewer = std::make_shared<Viewer>(viewers);
  out.set_chunked_content_provider("text/event-stream", [this, viewer](std::size_t, httplib::DataSink& sink) { return send_news(feed, *viewer, sink); });
}

void WebServer::State::answer_history(httplib::Response& out) {
  if (!take_place(histories, kMostHistories, out)) return;
  auto place = std::make_shared<Place>(histories);
  auto text = std::make_shared<const std::string>(feed.history(steady_now_ns()));
  out.set_content_provider(text->size(), "application/json", [place, text](std::size_t from, std::size_t size, httplib::DataSink& sink) { return sink.write(text->data() + from, size); });
}

void WebServer::State::set_routes() {
  server.set_pre_routing_handler([this](const httplib::Request& in, httplib::Response& out) { return admit(in, out); });
  server.Get("/", [](const httplib::Request&, httplib::Response& out) { out.set_content(web_page().data(), web_page().size(), "text/html; charset=utf-8"); });
  server.Get("/events", [this](const httplib::Request&, httplib::Response& out) { answer_events(out); });
  server.Get("/history", [this](const httplib::Request&, httplib::Response& out) { answer_history(out); });
  server.Get("/health", [this](const httplib::Request&, httplib::Response& out) { out.set_content(feed.health(steady_now_ns()), "application/json"); });
}

WebServer::WebServer(WebFeed& feed) : s_(std::make_unique<State>(feed)) {}
WebServer::~WebServer() { stop(); }

Result<int> WebServer::start(int port) {
  State& s = *s_;
  s.set_limits();
  s.set_routes();
  s.port = port == 0 ? s.server.bind_to_any_port("127.0.0.1") : s.server.bind_to_port("127.0.0.1", port) ? port : -1;
  if (s.port <= 0) return make_error(ErrorCode::kIo, "127.0.0.1:" + std::to_string(port), "cannot be served: is the port in use?");
  s.server.queue_more();
  s.thread = std::thread([&s] { s.server.listen_after_bind(); });
  while (!s.server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // stop() before it runs would be lost
  return s.port;
}

void WebServer::stop() {
  s_->feed.stop();
  s_->server.stop();
  if (s_->thread.joinable()) s_->thread.join();
  s_->server.close();
}

}  // namespace cyclops::tools
