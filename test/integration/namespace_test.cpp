#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include <string>

namespace {

TEST(Namespace, CarriesLcmMulticastOnLoopback) {
  lcm::LCM receiver("udpm://239.255.76.67:7667?ttl=0"), sender("udpm://239.255.76.67:7667?ttl=0");
  ASSERT_TRUE(receiver.good());
  ASSERT_TRUE(sender.good());
  std::string got;
  receiver.subscribeFunction<std::string*>(
      "PING", [](const lcm::ReceiveBuffer* b, const std::string&, std::string* out) { out->assign(static_cast<const char*>(b->data), b->data_size); }, &got);
  sender.publish("PING", "hello", 5);
  ASSERT_GT(receiver.handleTimeout(2000), 0);
  EXPECT_EQ(got, "hello");
}

}  // namespace
