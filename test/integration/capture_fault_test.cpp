// What goes wrong on the wire: lost, doubled and swapped packets, frames that are not what was configured.
#include "test/integration/capture_rig.hpp"

namespace cyclops::test {
namespace {

using hil::faults::Reach;

/// 400 x 300 x 8 bit in packets of 1500: rows and packets do not line up.
CaptureRig small_packets(bool extended = true) {
  CaptureRig rig(400, 300);
  rig.config.packet_bytes = 1500;
  rig.device_config.extended_ids = extended;
  return rig;
}
std::optional<CameraFrame> send_and_get(CaptureRig& rig, std::uint64_t id, const Image& image) {
  EXPECT_TRUE(rig.send(id, image.view).sent);
  return rig.next<CameraFrame>();
}

TEST(CaptureFaults, ALostPacketIsRepairedByAResend) {
  CaptureRig rig = small_packets();
  rig.open();
  const Image sent(400, 300, PixelFormat::kMono8, 1);
  rig.device->set_fault(hil::faults::drop_packets(1, {0, 3, 4, 40, 83}, Reach::kOnce));
  auto frame = send_and_get(rig, 1, sent);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->info.status, FrameStatus::kComplete);
  EXPECT_EQ(frame->info.camera_frame_id, 1U);
  EXPECT_TRUE(same(frame->image, sent));
  EXPECT_GE(rig.source->counters().packets.resent, 5U);
  EXPECT_GE(rig.device->stats().resent_packets, 5U);
}

class CaptureHoles : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Ids, CaptureHoles, ::testing::Bool(), [](const auto& i) { return i.param ? "Extended" : "Short"; });

TEST_P(CaptureHoles, WhatCannotBeRepairedIsMaskedAndTheRestIsExact) {
  CaptureRig rig = small_packets(GetParam());
  rig.open();
  const hil::GvspLayout layout{GetParam(), 1500};
  const int room = layout.payload_bytes(), size = 400 * 300;
  const auto count = static_cast<int>(layout.packets(static_cast<std::size_t>(size)));
  std::uint64_t id = 0;
  for (const std::set<std::uint32_t>& lost : {std::set<std::uint32_t>{1}, {static_cast<std::uint32_t>(count - 2)}, {7, 8, 30},
                                              {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 50}}) {
    const Image sent(400, 300, PixelFormat::kMono8, ++id);
    rig.device->set_fault(hil::faults::drop_packets(id, lost, Reach::kForEver));
    auto frame = send_and_get(rig, id, sent);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->info.status, FrameStatus::kPartial);
    EXPECT_EQ(frame->info.camera_frame_id, id);
    RowMask expected;
    for (std::uint32_t p : lost)
      for (int v = static_cast<int>(p - 1) * room / 400; v <= (std::min(static_cast<int>(p) * room, size) - 1) / 400; ++v) expected.set_missing(v);
    for (int v = 0; v < 300; ++v) {
      EXPECT_EQ(frame->missing.missing(v), expected.missing(v)) << "row " << v << " of frame " << id;
      if (!expected.missing(v)) { EXPECT_TRUE(same_rows(frame->image, sent, v, v)) << "row " << v; }
    }
    EXPECT_EQ(frame->info.missing_rows, static_cast<std::uint32_t>(expected.count()));
  }
  EXPECT_EQ(rig.source->counters().incomplete, 4U);
}

TEST(CaptureFaults, ATruncatedFrameKeepsItsUpperRows) {
  CaptureRig rig = small_packets();
  rig.open();
  const Image sent(400, 300, PixelFormat::kMono8, 1);
  rig.device->set_fault(hil::faults::truncate(1, 41, Reach::kForEver));
  auto frame = send_and_get(rig, 1, sent);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->info.status, FrameStatus::kPartial);
  const int whole = 40 * (1500 - 48) / 400;
  EXPECT_EQ(frame->info.missing_rows, static_cast<std::uint32_t>(300 - whole));
  EXPECT_TRUE(same_rows(frame->image, sent, 0, whole - 1));
}

TEST(CaptureFaults, AFrameWithoutTrailerHasAllItsPixels) {
  CaptureRig rig = small_packets();
  rig.open();
  const Image sent(400, 300, PixelFormat::kMono8, 1);
  rig.device->set_fault(hil::faults::drop_trailer(1, Reach::kForEver));
  auto frame = send_and_get(rig, 1, sent);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->info.status, FrameStatus::kComplete);
  EXPECT_TRUE(same(frame->image, sent));
}

TEST(CaptureFaults, AFrameThatNeverCameIsCountedAndShowsAsAGap) {
  CaptureRig rig = small_packets();
  rig.open();
  const Image sent(400, 300, PixelFormat::kMono8, 1);
  rig.device->set_fault(hil::faults::drop_frame(2));
  ASSERT_TRUE(send_and_get(rig, 1, sent).has_value());
  ASSERT_TRUE(rig.send(2, sent.view).sent);
  auto frame = send_and_get(rig, 3, sent);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->info.seq, 3U);
  EXPECT_EQ(rig.source->counters().lost_gap, 1U);
}

TEST(CaptureFaults, AFrameWithoutLeaderIsMissingAndItsOldIdIsNotReported) {
  // GIVEN buffers that have all been used, so that stale ids would be in them
  CaptureRig rig = small_packets();
  rig.config.buffers = 4;
  rig.open();
  const Image sent(400, 300, PixelFormat::kMono8, 1);
  for (std::uint64_t id = 1; id <= 6; ++id) ASSERT_TRUE(send_and_get(rig, id, sent).has_value());
  // WHEN a leader is lost for good
  rig.device->set_fault(hil::faults::drop_leader(7, Reach::kForEver));
  auto frame = send_and_get(rig, 7, sent);
  // THEN the frame is announced without id, tick and pixels, and the next one goes on counting
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->info.status, FrameStatus::kMissing);
  EXPECT_EQ(frame->info.camera_frame_id, 0U);
  EXPECT_EQ(frame->info.camera_tick_ns, 0);
  EXPECT_EQ(frame->info.seq, 7U);
  EXPECT_EQ(frame->image.data, nullptr);
  EXPECT_EQ(frame->missing.count(), 300);
  auto after = send_and_get(rig, 8, sent);
  ASSERT_TRUE(after.has_value());
  EXPECT_EQ(after->info.seq, 8U);
  EXPECT_EQ(rig.source->counters().lost_leader, 1U);
  EXPECT_EQ(rig.source->counters().lost_gap, 0U);
}

TEST(CaptureFaults, DoubledAndSwappedPacketsDoNoHarm) {
  CaptureRig rig = small_packets();
  rig.open();
  std::uint64_t id = 0;
  for (const hil::PacketFault& fault : {hil::faults::duplicate_all(), hil::faults::swap_pairs()}) {
    const Image sent(400, 300, PixelFormat::kMono8, ++id);
    rig.device->set_fault(fault);
    auto frame = send_and_get(rig, id, sent);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->info.status, FrameStatus::kComplete);
    EXPECT_TRUE(same(frame->image, sent));
  }
  EXPECT_GT(rig.source->counters().packets.duplicated, 0U);
}

TEST(CaptureFaults, NoiseOfTwoPercentIsRepaired) {
  CaptureRig rig = small_packets();
  rig.open();
  rig.device->set_fault(hil::faults::lose_ratio(0.02, 4711));
  std::uint64_t whole = 0;
  for (std::uint64_t id = 1; id <= 20; ++id) {
    const Image sent(400, 300, PixelFormat::kMono8, id);
    auto frame = send_and_get(rig, id, sent);
    ASSERT_TRUE(frame.has_value());
    if (frame->info.status == FrameStatus::kComplete) {
      ++whole;
      EXPECT_TRUE(same(frame->image, sent));
    }
  }
  if (!rig.device_was_late()) { EXPECT_GE(whole, 19U); }  // a packet may be lost, and lost again, until time is up
  EXPECT_GT(rig.device->stats().resent_packets, 0U);
}

TEST(CaptureFaults, AFrameOfAnotherSizeIsAFaultThatNamesBothSizes) {
  CaptureRig rig;
  rig.config.watchdog_periods = 10;
  rig.open();
  const Image good(320, 240, PixelFormat::kMono8, 1);
  std::uint64_t id = 0;
  for (const Image& bad : {Image(320, 200, PixelFormat::kMono8, 2), Image(640, 480, PixelFormat::kMono8, 3)}) {
    ASSERT_TRUE(rig.send(++id, bad.view).sent);
    auto fault = rig.next<CameraFault>();
    ASSERT_TRUE(fault.has_value());
    EXPECT_NE(fault->error.what.find(std::to_string(bad.view.width) + "x" + std::to_string(bad.view.height)), std::string::npos);
    EXPECT_NE(fault->error.what.find("expected 320x240"), std::string::npos);
  }
  ASSERT_TRUE(rig.send(++id, Image(160, 240, PixelFormat::kMono12, 4).view).sent);  // as many bytes, another meaning
  ASSERT_TRUE(rig.next<CameraFault>().has_value());
  auto frame = send_and_get(rig, ++id, good);
  ASSERT_TRUE(frame.has_value());
  EXPECT_TRUE(same(frame->image, good));
  EXPECT_EQ(frame->info.seq, 4U);
  EXPECT_EQ(rig.source->counters().lost_size_mismatch, 3U);
}

TEST(CaptureFaults, FramesThatStayOfAnotherSizeEndTheStreamSoThatTheSettingsAreWrittenAgain) {
  CaptureRig rig;
  rig.open();
  const Image bad(320, 200, PixelFormat::kMono8, 2), good(320, 240, PixelFormat::kMono8, 1);
  for (std::uint64_t id = 1; id <= 3; ++id) ASSERT_TRUE(rig.send(id, bad.view).sent);
  auto lost = rig.next<CameraLost>();
  ASSERT_TRUE(lost.has_value());
  EXPECT_EQ(lost->reason, LossReason::kWrongSize);
  ASSERT_TRUE(rig.next<CameraStarted>().has_value());
  auto frame = send_and_get(rig, 1, good);
  ASSERT_TRUE(frame.has_value());
  EXPECT_TRUE(same(frame->image, good));
}

}  // namespace
}  // namespace cyclops::test
