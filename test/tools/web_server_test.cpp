// The page over real sockets on 127.0.0.1, as browsers and as others use it.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include <cyclops/health_t.hpp>

#include "tools/http.hpp"
#include "tools/web_server.hpp"

namespace cyclops::tools {
namespace {

class WebServerTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto served = server_.start(0);
    ASSERT_TRUE(served.ok()) << served.error().message();
    port_ = *served;
    client_ = std::make_unique<httplib::Client>("127.0.0.1", port_);
  }
  void tell_health() {
    health_t h{};
    h.version = "9.9";
    std::vector<std::uint8_t> b(static_cast<std::size_t>(h.getEncodedSize()));
    h.encode(b.data(), 0, static_cast<int>(b.size()));
    feed_.put("HEALTH", b.data(), b.size(), 1);
  }
  int connected() const {
    const int s = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port_));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(s, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
    return s;
  }
  /// What the server says to these bytes, up to 4 kB.
  std::string answer(const std::string& request) const {
    const int s = connected();
    EXPECT_EQ(::send(s, request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
    std::string out(4096, '\0');
    const ssize_t n = ::recv(s, out.data(), out.size(), 0);
    ::close(s);
    out.resize(static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
    return out;
  }
  std::string host() const { return std::string("Host: 127.0.0.1:").append(std::to_string(port_)).append("\r\n"); }

  WebFeed feed_;
  WebServer server_{feed_};
  int port_{0};
  std::unique_ptr<httplib::Client> client_;
};

TEST_F(WebServerTest, ServesThePageWithAPolicyThatAllowsNothingForeign) {
  const auto page = client_->Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_EQ(page->body, web_page());
  const std::string policy = page->get_header_value("Content-Security-Policy");
  EXPECT_EQ(policy.find("unsafe"), std::string::npos) << policy;
  EXPECT_EQ(policy.rfind("default-src 'none'", 0), 0U);
  EXPECT_EQ(page->body.find("http://"), std::string::npos);   // nothing is fetched from anywhere
  EXPECT_EQ(page->body.find("https://"), std::string::npos);
  EXPECT_EQ(page->body.find("innerHTML"), std::string::npos); // nothing that came over the network becomes markup
}

TEST_F(WebServerTest, TellsHealthAsJsonAndAsEvents) {
  tell_health();
  const auto health = client_->Get("/health");
  ASSERT_TRUE(health);
  EXPECT_NE(health->body.find("\"version\":\"9.9\""), std::string::npos);
  std::string heard;
  client_->Get("/events", [&](const char* data, std::size_t n) {
    heard.append(data, n);
    return heard.find("\n\n") == std::string::npos;
  });
  EXPECT_EQ(heard.rfind("event: health\ndata: {", 0), 0U) << heard;
  const auto history = client_->Get("/history");
  ASSERT_TRUE(history);
  EXPECT_NE(history->body.find("\"range_m\":[0.0]"), std::string::npos) << history->body;
}

TEST_F(WebServerTest, AnswersNobodyWhoCallsItByAnotherName) {
  for (const char* name : {"evil.example", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example", ""})
    EXPECT_NE(answer("GET /health HTTP/1.1\r\nHost: " + std::string(name) + "\r\nConnection: close\r\n\r\n").find(" 403 "), std::string::npos) << name;
  EXPECT_NE(answer("GET /health HTTP/1.0\r\n\r\n").find(" 403 "), std::string::npos);
  EXPECT_NE(answer("GET /health HTTP/1.1\r\n" + host() + host() + "Connection: close\r\n\r\n").find(" 403 "), std::string::npos);
  EXPECT_NE(answer("GET /health HTTP/1.1\r\n" + host() + "Origin: http://evil.example\r\nConnection: close\r\n\r\n").find(" 403 "), std::string::npos);
  EXPECT_NE(answer("GET /health HTTP/1.1\r\n" + host() + "Connection: close\r\n\r\n").find(" 200 "), std::string::npos);
}

TEST_F(WebServerTest, OnlyReadsAndOnlyItsOwnPaths) {
  for (const char* method : {"POST", "PUT", "DELETE", "PATCH", "OPTIONS"}) {
    const std::string said = answer(std::string(method) + " /health HTTP/1.1\r\n" + host() + "Content-Length: 0\r\nConnection: close\r\n\r\n");
    EXPECT_NE(said.find(" 405 "), std::string::npos) << method << said;
  }
  for (const char* path : {"/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/index.html", "/health/", "/etc/passwd%00"}) {
    const std::string said = answer(std::string("GET ") + path + " HTTP/1.1\r\n" + host() + "Connection: close\r\n\r\n");
    EXPECT_TRUE(said.find(" 404 ") != std::string::npos || said.find(" 400 ") != std::string::npos) << path << said;
    EXPECT_EQ(said.find("root:"), std::string::npos);
  }
}

TEST_F(WebServerTest, RefusesWhatIsTooLargeOrNoHttp) {
  EXPECT_EQ(answer("GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\n" + host() + "\r\n").find(" 200 "), std::string::npos);
  EXPECT_EQ(answer(std::string(1000, '\xff') + "\r\n\r\n").find(" 200 "), std::string::npos);
  EXPECT_EQ(client_->Get("/health")->status, 200);
}

TEST_F(WebServerTest, ViewersBeyondTheLimitAreTurnedAwayAndOthersStillServed) {
  std::vector<int> viewers;
  for (int i = 0; i < WebServer::kMostViewers; ++i) {
    viewers.push_back(connected());
    const std::string request = "GET /events HTTP/1.1\r\n" + host() + "\r\n";
    ASSERT_EQ(::send(viewers.back(), request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
    char c = 0;
    ASSERT_EQ(::recv(viewers.back(), &c, 1, 0), 1);  // its headers: it counts now
  }
  EXPECT_EQ(client_->Get("/events")->status, 503);
  for (int i = 0; i < 2000; ++i) tell_health();      // nobody reads; nobody waits for them
  EXPECT_EQ(client_->Get("/health")->status, 200);
  for (const int s : viewers) ::close(s);
}

TEST_F(WebServerTest, WhoHoldsConnectionsKeepsNobodyOut) {
  // GIVEN far more connections than threads that say nothing, others that say half a request, and all viewers' places taken
  std::vector<int> held;
  const std::string events = "GET /events HTTP/1.1\r\n" + host() + "\r\n";
  for (int i = 0; i < WebServer::kMostViewers; ++i) {
    held.push_back(connected());
    ASSERT_EQ(::send(held.back(), events.data(), events.size(), MSG_NOSIGNAL), static_cast<ssize_t>(events.size()));
  }
  for (int i = 0; i < 300; ++i) {
    held.push_back(connected());
    if (i % 2 == 0) { ASSERT_EQ(::send(held.back(), "GET / HTTP/1.1\r\nX", 17, MSG_NOSIGNAL), 17); }
    // WHEN somebody asks meanwhile THEN the page and HEALTH are there
    if (i % 50 != 0) continue;
    const auto page = client_->Get("/");
    ASSERT_TRUE(page);
    EXPECT_EQ(page->status, 200);
    EXPECT_EQ(client_->Get("/health")->status, 200);
  }
  char c = 0;
  EXPECT_LE(::recv(held[WebServer::kMostViewers], &c, 1, 0), 0) << "the one that had waited longest made room";
  for (const int s : held) ::close(s);
}

TEST_F(WebServerTest, WhoReadsNoAnswersKeepsNobodyOut) {
  for (int i = 0; i < 3000; ++i) {
    health_t h{};
    h.range_m = h.closure_mps = h.frame_rate_hz = h.latency_ms_p99 = h.residual_rms_px = h.time_sigma_us = 1.0F / 3;
    std::vector<std::uint8_t> b(static_cast<std::size_t>(h.getEncodedSize()));
    h.encode(b.data(), 0, static_cast<int>(b.size()));
    feed_.put("HEALTH", b.data(), b.size(), i * std::int64_t{200'000'000});
  }
  std::vector<int> held;
  for (int i = 0; i < 40; ++i) {
    held.push_back(connected());
    const int least = 1;
    ::setsockopt(held.back(), SOL_SOCKET, SO_RCVBUF, &least, sizeof least);
    const std::string request = std::string(i % 2 == 0 ? "GET /history" : "GET /") + " HTTP/1.1\r\n" + host() + "\r\n";
    ASSERT_EQ(::send(held.back(), request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
  }
  const auto page = client_->Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->body, web_page());
  EXPECT_EQ(client_->Get("/health")->status, 200);
  for (const int s : held) ::close(s);
}

TEST_F(WebServerTest, AHeadInPiecesIsAnsweredWhenItIsWhole) {
  const int s = connected();
  for (const char c : "GET /health HTTP/1.1\r\n" + host() + "\r\n") {
    ASSERT_EQ(::send(s, &c, 1, MSG_NOSIGNAL), 1);
    std::this_thread::yield();
  }
  char said[13] = "";
  EXPECT_EQ(::recv(s, said, 12, MSG_WAITALL), 12);
  EXPECT_STREQ(said, "HTTP/1.1 200");
  ::close(s);
}

TEST_F(WebServerTest, IsBoundToTheLoopbackAndASecondServerFailsOnItsPort) {
  WebFeed other_feed;
  WebServer other(other_feed);
  EXPECT_FALSE(other.start(port_).ok());
}

}  // namespace
}  // namespace cyclops::tools
