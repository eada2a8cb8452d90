// How the bench camera cuts frames into packets, paces them and keeps them for resends.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "hil/gige_faults.hpp"
#include "hil/gvcp.hpp"
#include "hil/gvsp.hpp"

namespace cyclops::hil {
namespace {

TEST(Gvsp, CutsAFrameIntoLeaderPayloadAndTrailerThatJoinToTheFrame) {
  for (const bool extended : {false, true}) {
    const GvspLayout layout{extended, 576};
    std::vector<std::uint8_t> image(10'007), joined;
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<std::uint8_t>(i * 7);
    const std::uint32_t count = layout.packets(image.size());
    for (std::uint32_t id = 0; id < count; ++id) {
      GvspPacket p;
      make_packet(layout, 0x1234, id, 0, {5, 6, 7, 8}, image, p);
      EXPECT_LE(p.head_bytes + p.body.size() + 28, 576U);
      const std::uint8_t content = p.head[4] & 0x7f;
      EXPECT_EQ(content, id == 0 ? 1 : id == count - 1 ? 2 : 3);
      EXPECT_EQ(extended ? get_be32(&p.head[16]) : get_be32(&p.head[4]) & 0xffffff, id);
      EXPECT_EQ(extended ? get_be64(&p.head[8]) : get_be16(&p.head[2]), 0x1234U);
      joined.insert(joined.end(), p.body.begin(), p.body.end());
    }
    EXPECT_EQ(joined, image);
  }
}

TEST(Gvsp, PutsTimeFormatAndSizeIntoTheLeader) {
  GvspPacket p;
  const std::vector<std::uint8_t> image(64);
  make_packet({true, 9000}, 1, 0, kGvspResent, {0x0102030405060708ULL, 0x01080001, 640, 481}, image, p);
  ASSERT_EQ(p.head_bytes, 20U + 36U);
  EXPECT_EQ(get_be16(&p.head[0]), kGvspResent);
  EXPECT_EQ(get_be64(&p.head[24]), 0x0102030405060708ULL);
  EXPECT_EQ(get_be32(&p.head[36]), 640U);
  EXPECT_EQ(get_be32(&p.head[40]), 481U);
}

TEST(Gvsp, NeverUsesBlockIdZeroWith16Bits) {
  const GvspLayout layout{false, 1500};
  EXPECT_EQ(layout.wire_id(1), 1U);
  EXPECT_EQ(layout.wire_id(65535), 65535U);
  EXPECT_EQ(layout.wire_id(65536), 1U);
  EXPECT_EQ((GvspLayout{true, 1500}.wire_id(65536)), 65536U);
}

TEST(Pacer, KeepsAbsoluteDeadlinesWhenASingleBatchIsLate) {
  Pacer pacer(1000, {4, Duration{170}, Duration{340}});
  EXPECT_EQ(pacer.leave(1000), 0);
  EXPECT_EQ(pacer.due(), 1170);
  EXPECT_EQ(pacer.leave(1400), 230);  // late, but less than the limit: the schedule stays
  EXPECT_EQ(pacer.due(), 1340);
  EXPECT_EQ(pacer.reanchored(), 0U);
}

TEST(Pacer, MovesTheScheduleInsteadOfBurstingWhenVeryLate) {
  Pacer pacer(1000, {4, Duration{170}, Duration{340}});
  EXPECT_EQ(pacer.leave(9000), 8000);
  EXPECT_EQ(pacer.due(), 9170);
  EXPECT_EQ(pacer.reanchored(), 1U);
}

TEST(Pacer, LetsAtMostTheLimitsWorthOfBatchesGoAtOnce) {
  Pacer pacer(0, {4, Duration{100}, Duration{200}});
  const std::int64_t now = 200;  // just not too late
  int at_once = 0;
  while (pacer.due() <= now) {
    (void)pacer.leave(now);
    ++at_once;
  }
  EXPECT_LE(at_once, 3);
}

TEST(RateLimit, LetsATenthOfASecondThroughAtOnceAndThenTheRate) {
  RateLimit limit(1000);
  EXPECT_EQ(limit.take(500, 1'000'000'000), 100U);
  EXPECT_EQ(limit.take(500, 1'000'000'000), 0U);
  EXPECT_EQ(limit.take(500, 1'050'000'000), 50U);
  EXPECT_EQ(limit.take(20, 9'000'000'000), 20U);
}

TEST(ResendRing, KeepsTheLastFramesAndNoOthers) {
  ResendRing ring(3);
  for (std::uint64_t id = 1; id <= 5; ++id) ring.replace().wire_id = id;
  EXPECT_EQ(ring.find(2), nullptr);
  for (std::uint64_t id = 3; id <= 5; ++id) ASSERT_NE(ring.find(id), nullptr);
  EXPECT_EQ(ring.find(0), nullptr);
  ring.forget();
  EXPECT_EQ(ring.find(5), nullptr);
}

TEST(Faults, AreTheSameForTheSameSeed) {
  const auto pattern = [](std::uint64_t seed) {
    std::string s;
    const PacketFault fault = faults::lose_ratio(0.1, seed);
    for (std::uint32_t i = 0; i < 1000; ++i) s += fault({1, i, 1000, false}) == PacketFate::kDrop ? 'x' : '.';
    return s;
  };
  EXPECT_EQ(pattern(1), pattern(1));
  EXPECT_NE(pattern(1), pattern(2));
  const std::string one = pattern(1);
  const auto lost = std::count(one.begin(), one.end(), 'x');
  EXPECT_NEAR(static_cast<double>(lost), 100.0, 40.0);
}

TEST(Faults, DoNotTouchResendsUnlessTold) {
  const PacketFault once = faults::drop_leader(7, faults::Reach::kOnce), ever = faults::drop_leader(7, faults::Reach::kForEver);
  EXPECT_EQ(once({7, 0, 9, false}), PacketFate::kDrop);
  EXPECT_EQ(once({7, 0, 9, true}), PacketFate::kSend);
  EXPECT_EQ(ever({7, 0, 9, true}), PacketFate::kDrop);
  EXPECT_EQ(ever({8, 0, 9, false}), PacketFate::kSend);
}

}  // namespace
}  // namespace cyclops::hil
