#include <gtest/gtest.h>

#include <thread>

#include "base/bounded_queue.hpp"
#include "base/histogram.hpp"
#include "base/log.hpp"
#include "base/static_vector.hpp"

namespace cyclops {
namespace {

TEST(BoundedQueue, RefusesAndCountsWhenFull) {
  BoundedQueue<int> queue(2);
  EXPECT_TRUE(queue.try_push(1));
  EXPECT_TRUE(queue.try_push(2));
  EXPECT_FALSE(queue.try_push(3));
  EXPECT_EQ(queue.refused(), 1u);
  EXPECT_EQ(queue.high_water(), 2u);
  EXPECT_EQ(queue.try_pop(), 1);
  EXPECT_EQ(queue.try_pop(), 2);
  EXPECT_EQ(queue.try_pop(), std::nullopt);
}

TEST(BoundedQueue, KeepsOrderBetweenTwoThreadsAndEndsWhenClosed) {
  BoundedQueue<int> queue(8);
  std::thread giver([&] {
    for (int i = 0; i < 1000;)
      if (queue.try_push(int(i))) ++i;
      else std::this_thread::yield();
    queue.close();
  });
  int expected = 0;
  while (auto item = queue.pop(Duration::from_seconds(5))) EXPECT_EQ(*item, expected++);
  giver.join();
  EXPECT_EQ(expected, 1000);
}

TEST(BoundedQueue, IsFinishedOnlyWhenClosedAndEmpty) {
  // GIVEN a queue that is only silent THEN waiting in vain does not mean the end
  BoundedQueue<int> queue(2);
  EXPECT_EQ(queue.pop(Duration::from_ms(1)), std::nullopt);
  EXPECT_FALSE(queue.finished());
  // WHEN it is closed with something in it THEN that comes out first
  EXPECT_TRUE(queue.try_push(1));
  queue.close();
  EXPECT_FALSE(queue.finished());
  EXPECT_EQ(queue.pop(Duration::from_ms(1)), 1);
  EXPECT_TRUE(queue.finished());
}

TEST(Histogram, QuantilesAreRightToTwoPercent) {
  Histogram h;
  for (int i = 1; i <= 10000; ++i) h.add(Duration{i * 1000});
  EXPECT_NEAR(h.quantile(0.5).seconds(), 5e-3, 0.022 * 5e-3);
  EXPECT_NEAR(h.quantile(0.99).seconds(), 9.9e-3, 0.022 * 9.9e-3);
  EXPECT_EQ(h.max(), Duration{10000000});
  EXPECT_EQ(h.count(), 10000u);
}

TEST(StaticVector, SaysWhenItIsFull) {
  StaticVector<int, 2> v;
  EXPECT_TRUE(v.try_push_back(1));
  EXPECT_TRUE(v.try_push_back(2));
  EXPECT_FALSE(v.try_push_back(3));
  EXPECT_EQ(v.size(), 2u);
}

TEST(Throttle, LetsOneThroughAndCountsTheRest) {
  log::Throttle throttle(1.0);
  std::uint64_t held = 9;
  EXPECT_TRUE(throttle.pass(5, held));
  EXPECT_EQ(held, 0u);
  EXPECT_FALSE(throttle.pass(6, held));
  EXPECT_FALSE(throttle.pass(7, held));
  EXPECT_TRUE(throttle.pass(1'000'000'006, held));
  EXPECT_EQ(held, 2u);
}

}  // namespace
}  // namespace cyclops
