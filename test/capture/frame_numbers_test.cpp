#include "capture/frame_numbers.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

TEST(FrameNumbers, CountFromOneWhateverTheFirstIdIs) {
  FrameNumbers n;
  EXPECT_EQ(n.next(4711).seq, 1U);
  EXPECT_EQ(n.next(4712).seq, 2U);
}

TEST(FrameNumbers, LeaveOutTheNumbersOfLostFrames) {
  FrameNumbers n;
  (void)n.next(10);
  const auto step = n.next(14);
  EXPECT_EQ(step.seq, 5U);
  EXPECT_EQ(step.lost, 3U);
}

TEST(FrameNumbers, GoOnThroughTheEndOf16Bits) {
  FrameNumbers n;
  (void)n.next(65534);
  EXPECT_EQ(n.next(65535).seq, 2U);
  EXPECT_EQ(n.next(1).seq, 3U);
  const auto step = n.next(3);
  EXPECT_EQ(step.seq, 5U);
  EXPECT_EQ(step.lost, 1U);
}

TEST(FrameNumbers, GoOnPast16BitsWhenIdsAreLonger) {
  FrameNumbers n;
  (void)n.next(65535);
  EXPECT_EQ(n.next(65536).seq, 2U);
  EXPECT_EQ(n.next(65537).seq, 3U);
}

TEST(FrameNumbers, SeeARestartInIdsThatGoBackRepeatOrJump) {
  for (const std::uint64_t id : {std::uint64_t{40}, std::uint64_t{39}, std::uint64_t{1}, std::uint64_t{5000}, ~std::uint64_t{0}}) {
    FrameNumbers n;
    (void)n.next(40);
    EXPECT_TRUE(n.next(id).restarted) << id;
  }
  FrameNumbers n;
  (void)n.next(40'000);
  EXPECT_TRUE(n.next(1).restarted);  // too far from the end of 16 bits
}

TEST(FrameNumbers, GiveAFrameWithoutIdTheNextNumberAndDoNotCountItTwice) {
  FrameNumbers n;
  (void)n.next(10);
  EXPECT_EQ(n.next_unknown().seq, 2U);
  auto step = n.next(12);
  EXPECT_EQ(step.seq, 3U);
  EXPECT_EQ(step.lost, 0U);
  (void)n.next_unknown();
  step = n.next(16);
  EXPECT_EQ(step.seq, 7U);
  EXPECT_EQ(step.lost, 2U);
}

TEST(FrameNumbers, ShowAGapBetweenStreams) {
  FrameNumbers n;
  (void)n.next(10);
  n.new_stream();
  EXPECT_EQ(n.next(1).seq, 3U);
}

}  // namespace
}  // namespace cyclops
