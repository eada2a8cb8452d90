#include "capture/strobe_source.hpp"

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <thread>

#include <unistd.h>

#include "hil/strobe_server.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

using hil::StrobeServer;

class SocketStrobe : public testing::Test {
 protected:
  SocketStrobe() {
    static int serial = 0;
    config_.socket = "@cyclops-test-" + std::to_string(::getpid()) + "-" + std::to_string(serial++);
    source_ = make_strobe_source(config_);
  }
  void serve() { server_.emplace(StrobeServer::open(config_.socket).value()); }
  void connect() {
    ASSERT_TRUE(source_->open().ok());
    server_->accept_waiting();
    ASSERT_EQ(server_->connected(), 1U);
  }
  void send(std::int64_t seq, bool rising = true, std::uint32_t line = 17) { server_->send({Time{1'000'000 * seq}, seq, rising}, line); }
  std::size_t read(Duration timeout = Duration::from_ms(1000)) {
    if (!source_->wait(timeout).value()) return 0;
    return source_->read_many(edges_).value();
  }

  StrobeConfig config_;
  std::unique_ptr<StrobeSource> source_;
  std::optional<StrobeServer> server_;
  std::array<StrobeEdge, 8> edges_;
};

TEST_F(SocketStrobe, CarriesStampAndNumberUnchanged) {
  serve();
  connect();
  server_->send({Time{5'000'000'000'000'000'123}, 7, true}, 17);
  ASSERT_EQ(read(), 1U);
  EXPECT_EQ(edges_[0].t.ns, 5'000'000'000'000'000'123);
  EXPECT_EQ(edges_[0].line_seq, 7);
  EXPECT_TRUE(edges_[0].rising);
  EXPECT_TRUE(source_->status().numbered);
  EXPECT_EQ(source_->status().edges, 1U);
}

TEST_F(SocketStrobe, ReadsManyAtOnceInOrderAndKeepsTheRest) {
  serve();
  connect();
  for (int i = 1; i <= 10; ++i) send(i);
  ASSERT_EQ(read(), 8U);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(edges_[static_cast<std::size_t>(i)].line_seq, i + 1);
  EXPECT_EQ(read(), 2U);
  EXPECT_EQ(source_->read_many(edges_).value(), 0U);
}

TEST_F(SocketStrobe, WaitEndsWithFalseWhenNothingComes) {
  serve();
  connect();
  EXPECT_FALSE(source_->wait(Duration::from_ms(5)).value());
}

TEST_F(SocketStrobe, AServerThatIsNotThereYetIsNoError) {
  ASSERT_TRUE(source_->open().ok());
  EXPECT_FALSE(source_->status().connected);
  EXPECT_FALSE(source_->wait(Duration::from_ms(5)).value());
  serve();
  EXPECT_FALSE(source_->wait(Duration::from_ms(50)).value());
  server_->accept_waiting();
  send(1);
  EXPECT_EQ(read(), 1U);
}

TEST_F(SocketStrobe, ComesBackAfterTheServerWentAway) {
  serve();
  connect();
  send(1);
  server_.reset();
  EXPECT_EQ(read(), 1U) << "what was sent before the end is not lost";
  EXPECT_FALSE(source_->wait(Duration::from_ms(30)).value());
  EXPECT_FALSE(source_->status().connected);
  EXPECT_EQ(source_->status().disconnects, 1U);
  serve();
  EXPECT_FALSE(source_->wait(Duration::from_ms(50)).value());
  send(1);
  EXPECT_EQ(read(), 1U);
  EXPECT_EQ(source_->status().lost, 0U) << "a new server numbers afresh";
}

TEST_F(SocketStrobe, CountsGapsInTheNumbers) {
  serve();
  connect();
  send(1);
  send(5);
  EXPECT_EQ(read(), 2U);
  EXPECT_EQ(source_->status().lost, 3U);
}

TEST_F(SocketStrobe, KeepsOtherLinesAndSlopesOut) {
  serve();
  connect();
  send(1, false);
  send(2, true, 4);
  send(3);
  ASSERT_EQ(read(), 1U);
  EXPECT_EQ(edges_[0].line_seq, 3);
  EXPECT_EQ(source_->status().foreign, 2U);
}

TEST_F(SocketStrobe, CountsRecordsOfTheWrongSize) {
  const auto address = abstract_address(config_.socket).value();
  Fd listener(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  ASSERT_EQ(::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address.address), address.length), 0);
  ASSERT_EQ(::listen(listener.get(), 1), 0);
  ASSERT_TRUE(source_->open().ok());
  Fd peer(::accept(listener.get(), nullptr, nullptr));
  char bytes[64] = {};
  for (const std::size_t size : {std::size_t{1}, sizeof(StrobeRecord) - 1, sizeof(StrobeRecord), sizeof bytes})
    ASSERT_EQ(::send(peer.get(), bytes, size, 0), static_cast<ssize_t>(size));
  EXPECT_EQ(read(), 0U);
  EXPECT_EQ(source_->status().malformed, 4U) << "the one of the right size has no known type";
}

TEST_F(SocketStrobe, WakesUpForAnEdgeSentWhileItWaits) {
  serve();
  connect();
  std::thread sender([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    send(1);
  });
  EXPECT_EQ(read(Duration::from_ms(5000)), 1U);
  sender.join();
}

TEST_F(SocketStrobe, UsesNoHeapPerEdge) {
  serve();
  connect();
  send(1);
  const test::HeapGuard guard;
  send(2);
  EXPECT_EQ(read(), 2U);
  EXPECT_EQ(guard.count(), 0U);
}

TEST(StrobeConfig, ABadSocketNameIsRefusedWithWhatIsExpected) {
  StrobeConfig config;
  for (const std::string& name : {std::string("cyclops"), std::string("@"), "@" + std::string(200, 'x')}) {
    config.socket = name;
    EXPECT_FALSE(make_strobe_source(config)->open().ok()) << name;
  }
}

TEST(StrobeConfig, ReadsTheRig) {
  auto file = ConfigFile::parse("[strobe]\nsource = \"gpio\"\nchip = \"pps\"\nline = 4\nline_name = \"STROBE\"\nsocket = \"@x\"\nedge = \"falling\"\ndelay_us = 12.5\n", "rig.toml").value();
  ConfigTable table = file.root().table("strobe");
  const StrobeConfig c = StrobeConfig::read(table, {}).value();
  ASSERT_TRUE(file.finish().ok());
  EXPECT_EQ(c.kind, StrobeKind::kGpio);
  EXPECT_EQ(c.line_name, "STROBE");
  EXPECT_FALSE(c.rising);
  EXPECT_EQ(c.delay.ns, 12'500);
}

TEST(StrobeConfig, NoneMakesNoSource) {
  StrobeConfig config;
  config.kind = StrobeKind::kNone;
  EXPECT_EQ(make_strobe_source(config), nullptr);
}

}  // namespace
}  // namespace cyclops
