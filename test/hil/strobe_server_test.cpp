#include "hil/strobe_server.hpp"

#include <gtest/gtest.h>

#include <array>

#include "capture/strobe_source.hpp"

namespace cyclops::hil {
namespace {

std::string unused_name() {
  static int serial = 0;
  return "@cyclops-server-test-" + std::to_string(::getpid()) + "-" + std::to_string(serial++);
}

std::unique_ptr<StrobeSource> client(const std::string& name) {
  StrobeConfig c;
  c.socket = name;
  auto source = make_strobe_source(c);
  EXPECT_TRUE(source->open().ok());
  return source;
}

TEST(StrobeServer, CountsEdgesThatNobodyWasThereFor) {
  auto server = StrobeServer::open(unused_name()).value();
  server.send({Time{1}, 1, true}, 17);
  EXPECT_EQ(server.counters().no_client, 1U);
  EXPECT_EQ(server.counters().delivered, 0U);
}

TEST(StrobeServer, SendsEachEdgeToEveryClient) {
  const std::string name = unused_name();
  auto server = StrobeServer::open(name).value();
  const auto a = client(name), b = client(name);
  server.send({Time{1}, 1, true}, 17);
  std::array<StrobeEdge, 4> edges;
  EXPECT_EQ(a->read_many(edges).value(), 1U);
  EXPECT_EQ(b->read_many(edges).value(), 1U);
  EXPECT_EQ(server.counters().delivered, 2U);
}

TEST(StrobeServer, AClientThatDoesNotReadLosesEdgesAndBothSidesCountThem) {
  // GIVEN a client that reads nothing
  // WHEN more edges are sent than its buffer holds
  // THEN sending never blocks, and what the server could not deliver is what the client finds missing
  const std::string name = unused_name();
  auto server = StrobeServer::open(name).value();
  const auto slow = client(name);
  constexpr int kEdges = 20'000;
  for (int i = 1; i <= kEdges; ++i) server.send({Time{i}, i, true}, 17);
  EXPECT_GT(server.counters().undelivered, 0U);
  EXPECT_EQ(server.counters().undelivered + server.counters().delivered, static_cast<std::uint64_t>(kEdges));
  std::array<StrobeEdge, 64> edges;
  while (slow->read_many(edges).value() > 0) {}
  server.send({Time{kEdges + 1}, kEdges + 1, true}, 17);
  EXPECT_EQ(slow->read_many(edges).value(), 1U);
  EXPECT_EQ(slow->status().lost, server.counters().undelivered);
}

TEST(StrobeServer, ForgetsAClientThatWentAway) {
  const std::string name = unused_name();
  auto server = StrobeServer::open(name).value();
  auto going = client(name);
  server.send({Time{1}, 1, true}, 17);
  going.reset();
  server.send({Time{2}, 2, true}, 17);
  EXPECT_EQ(server.connected(), 0U);
  EXPECT_EQ(server.counters().gone, 1U);
}

TEST(StrobeServer, ANameInUseIsRefused) {
  const std::string name = unused_name();
  const auto first = StrobeServer::open(name).value();
  const auto second = StrobeServer::open(name);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kIo);
  EXPECT_EQ(second.error().where, name);
}

}  // namespace
}  // namespace cyclops::hil
