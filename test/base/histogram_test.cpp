#include "base/histogram.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

TEST(RecentHistogram, CoversOneToTwoSpansAndIsNotEmptyRightAfterATurn) {
  RecentHistogram recent;
  recent.add(Duration::from_ms(90));
  recent.turn();
  EXPECT_EQ(recent.max(), Duration::from_ms(90));   // of the span before
  recent.add(Duration::from_ms(10));
  EXPECT_EQ(recent.max(), Duration::from_ms(90));
  recent.turn();
  EXPECT_EQ(recent.max(), Duration::from_ms(10));   // what is two spans old is gone
  recent.turn();
  EXPECT_EQ(recent.quantile(0.99), Duration{});
}

}  // namespace
}  // namespace cyclops
