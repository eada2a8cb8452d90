// Frames from the bench camera to capture, over UDP packets on loopback: what arrives is what was sent.
#include "test/integration/capture_rig.hpp"

namespace cyclops::test {
namespace {

struct Shape {
  const char* name;
  int width;
  int height;
  PixelFormat format;
  bool extended;
};
class CaptureFormats : public ::testing::TestWithParam<Shape> {};

TEST_P(CaptureFormats, DeliversEveryPixelIdAndTimestampExactly) {
  const Shape& shape = GetParam();
  CaptureRig rig(shape.width, shape.height, shape.format);
  rig.device_config.extended_ids = shape.extended;
  rig.open();
  for (std::uint64_t id = 1; id <= 3; ++id) {
    const Image sent(shape.width, shape.height, shape.format, id);
    ASSERT_TRUE(rig.send(id, sent.view).sent);
    auto frame = rig.next<CameraFrame>();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->info.status, FrameStatus::kComplete);
    EXPECT_EQ(frame->info.camera_frame_id, id);
    EXPECT_EQ(frame->info.seq, id);
    EXPECT_EQ(frame->info.camera_tick_ns, static_cast<std::int64_t>(id) * 1'000'000 + 7);
    EXPECT_TRUE(same(frame->image, sent));
  }
}
INSTANTIATE_TEST_SUITE_P(
    Wire, CaptureFormats,
    ::testing::Values(Shape{"Mono8Odd", 640, 481, PixelFormat::kMono8, true}, Shape{"Mono10Odd", 641, 481, PixelFormat::kMono10, true},
                      Shape{"Mono12Odd", 640, 481, PixelFormat::kMono12, true}, Shape{"Mono16Odd", 639, 481, PixelFormat::kMono16, true},
                      Shape{"Mono8ShortIds", 640, 481, PixelFormat::kMono8, false},
                      Shape{"Mono12ShortIds", 640, 481, PixelFormat::kMono12, false}, Shape{"OnePixel", 1, 1, PixelFormat::kMono8, true}),
    [](const auto& i) { return i.param.name; });

TEST(Capture, DeliversAFrameOf4096x4096x16BitExactly) {
  CaptureRig rig(4096, 4096, PixelFormat::kMono16);
  rig.config.buffers = 4;
  rig.config.watchdog_least = Duration::from_seconds(5);
  rig.device_config.resend_frames = 1;
  rig.open();
  const Image sent(4096, 4096, PixelFormat::kMono16, 1);
  ASSERT_TRUE(rig.send(1, sent.view).sent);
  auto frame = rig.next<CameraFrame>();
  ASSERT_TRUE(frame.has_value());
  if (rig.device_was_late() && frame->info.status != FrameStatus::kComplete) GTEST_SKIP() << "the device missed its deadlines";
  EXPECT_EQ(frame->info.status, FrameStatus::kComplete);
  EXPECT_TRUE(same(frame->image, sent));
}

TEST(Capture, KeepsTimestampsAndIdsOf64Bits) {
  CaptureRig rig;
  rig.open();
  const Image sent(320, 240, PixelFormat::kMono8, 1);
  const std::uint64_t id = (1ULL << 40) + 5;
  const std::int64_t t = 1'234'567'890'123'456'789;
  ASSERT_TRUE(rig.device->send({id, t, sent.view}, 0).sent);
  auto frame = rig.next<CameraFrame>();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->info.camera_frame_id, id);
  EXPECT_EQ(frame->info.camera_tick_ns, t);
}

TEST(Capture, ScalesTheTicksOfASlowerCameraClock) {
  CaptureRig rig;
  rig.device_config.tick_hz = 125'000'000;
  rig.open();
  const Image sent(320, 240, PixelFormat::kMono8, 1);
  ASSERT_TRUE(rig.device->send({1, 5'000'000'123, sent.view}, 0).sent);
  auto frame = rig.next<CameraFrame>();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->info.camera_tick_ns, 5'000'000'120);
}

TEST(Capture, CountsOnThroughTheEndOf16BitIds) {
  CaptureRig rig;
  rig.device_config.extended_ids = false;
  rig.open();
  const Image sent(320, 240, PixelFormat::kMono8, 1);
  const std::uint64_t wire[] = {65534, 65535, 1, 2};
  for (std::uint64_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(rig.send(65534 + i, sent.view).sent);
    auto frame = rig.next<CameraFrame>();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->info.camera_frame_id, wire[i]);
    EXPECT_EQ(frame->info.seq, i + 1);
  }
  EXPECT_EQ(rig.source->counters().lost_gap, 0U);
}

TEST(Capture, StampsTheArrivalOfTheFirstPacketOnTheServiceClock) {
  CaptureRig rig;
  rig.open();
  const Image sent(320, 240, PixelFormat::kMono8, 1);
  for (std::uint64_t id = 1; id <= 3; ++id) {
    const std::int64_t before = hil::monotonic_ns();
    ASSERT_TRUE(rig.send(id, sent.view).sent);
    auto frame = rig.next<CameraFrame>();
    ASSERT_TRUE(frame.has_value());
    EXPECT_GE(frame->info.t_arrival.ns, before);
    EXPECT_LE(frame->info.t_arrival.ns, hil::monotonic_ns());
  }
}

TEST(Capture, UsesNoHeapPerFrame) {
  CaptureRig rig;
  rig.open();
  const Image sent(320, 240, PixelFormat::kMono8, 1);
  std::uint64_t used = 0;
  for (std::uint64_t id = 1; id <= 30; ++id) {
    ASSERT_TRUE(rig.send(id, sent.view).sent);
    const HeapGuard guard;
    CameraEvent event = CameraTimeout{};
    while (std::holds_alternative<CameraTimeout>(event)) event = rig.source->poll(Duration::from_ms(50));
    event = CameraTimeout{};  // gives the frame back
    used += guard.count();
  }
  EXPECT_EQ(used, 0U);
}

TEST(Capture, LosesFramesForWantOfABufferCountsThemAndGoesOn) {
  // GIVEN a pool of four and a reader that holds on to all of it
  CaptureRig rig;
  rig.config.buffers = 4;
  rig.open();
  const Image sent(320, 240, PixelFormat::kMono8, 1);
  std::vector<CameraFrame> held;
  std::uint64_t id = 0;
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(rig.send(++id, sent.view).sent);
    auto frame = rig.next<CameraFrame>();
    ASSERT_TRUE(frame.has_value());
    held.push_back(std::move(*frame));
  }
  // WHEN two more frames come, and then the reader lets go
  ASSERT_TRUE(rig.send(++id, sent.view).sent);
  ASSERT_TRUE(rig.send(++id, sent.view).sent);
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  held.clear();
  ASSERT_TRUE(rig.send(++id, sent.view).sent);
  // THEN the next one arrives with a number that shows the gap, and the cause is known
  auto frame = rig.next<CameraFrame>();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->info.seq, 7U);
  EXPECT_TRUE(same(frame->image, sent));
  frame.reset();
  EXPECT_EQ(rig.source->counters().lost_no_buffer, 2U);
  EXPECT_GT(rig.source->counters().packets.no_buffer, 0U);
}

TEST(Capture, StreamsAtThirtyFramesASecondWithoutLossWhileTheDeviceIsOnTime) {
  CaptureRig rig(1024, 1024);
  rig.open();
  const Image sent(1024, 1024, PixelFormat::kMono8, 1);
  std::thread camera([&] {
    const std::int64_t start = hil::monotonic_ns();
    for (std::uint64_t id = 1; id <= 60; ++id)
      (void)rig.device->send({id, 0, sent.view}, start + static_cast<std::int64_t>(id) * rig.config.period().ns);
  });
  int complete = 0;
  std::uint64_t last = 0;
  while (last < 60) {
    auto frame = rig.next<CameraFrame>();
    if (!frame) break;
    last = frame->info.camera_frame_id != 0 ? frame->info.camera_frame_id : last;
    complete += frame->info.status == FrameStatus::kComplete ? 1 : 0;
  }
  camera.join();
  RecordProperty("max_late_us", static_cast<int>(rig.device->stats().max_late.ns / 1000));
  if (rig.device_was_late()) GTEST_SKIP() << "the device was " << rig.device->stats().max_late.seconds() << " s late, " << complete << " of 60 complete";
  EXPECT_EQ(complete, 60);
}

}  // namespace
}  // namespace cyclops::test
