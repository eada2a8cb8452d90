// The camera is not there, is not what was configured, goes away and comes back.
#include "test/integration/capture_rig.hpp"

namespace cyclops::test {
namespace {

double seconds_since(std::int64_t start) { return static_cast<double>(hil::monotonic_ns() - start) * 1e-9; }

/// Opens and expects an error that contains every one of `words`.
void expect_refused(const CameraConfig& config, ErrorCode code, std::initializer_list<const char*> words) {
  const auto source = CameraSource::open(config);
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.error().code, code);
  for (const char* word : words) EXPECT_NE(source.error().message().find(word), std::string::npos) << source.error().message();
}

TEST(CaptureOpen, WithoutACameraFailsSoonAndNamesTheAddress) {
  CaptureRig rig;
  const std::int64_t start = hil::monotonic_ns();
  expect_refused(rig.config, ErrorCode::kNotFound, {"camera 127.0.0.", "no GigE Vision device answers"});
  EXPECT_LT(seconds_since(start), 5.0);
}

TEST(CaptureOpen, ACameraOfAnotherSizeIsRefusedWithSettingValueAndExpectation) {
  CaptureRig rig(640, 481);
  rig.device_config.fixed_geometry = true;
  rig.start_device();
  expect_refused(rig.config, ErrorCode::kInvalid, {": Width: is 1024, expected 640"});
}

TEST(CaptureOpen, ACameraWithAnotherPixelFormatIsRefused) {
  CaptureRig rig(1024, 768, PixelFormat::kMono12);
  rig.device_config.fixed_geometry = true;
  rig.start_device();
  expect_refused(rig.config, ErrorCode::kInvalid, {": PixelFormat: is Mono8, expected Mono12"});
}

TEST(CaptureOpen, AnExposureOutOfTheCamerasRangeIsRefused) {
  CaptureRig rig;
  rig.config.frame_rate_hz = 0.05;
  expect_refused(rig.config, ErrorCode::kInvalid, {"camera.frame_rate_hz"});
  rig.config.frame_rate_hz = 30;
  rig.config.width_px = 2048;
  rig.device_config.max_width = 1024;
  rig.start_device();
  expect_refused(rig.config, ErrorCode::kInvalid, {": Width: is 1024, expected 2048"});
}

TEST(CaptureOpen, ACameraInOtherHandsIsRefused) {
  CaptureRig rig;
  rig.open();
  expect_refused(rig.config, ErrorCode::kIo, {"another program is in control"});
}

TEST(CaptureOpen, AppliesAndReportsEverySetting) {
  CaptureRig rig(640, 480, PixelFormat::kMono12);
  rig.config.exposure_us = 1234.0;
  rig.config.frame_rate_hz = 59.94;
  rig.config.strobe_line = "Line1";
  rig.device_config.max_packet_bytes = 8000;
  rig.open();
  const hil::GigeSettings s = rig.device->settings();
  EXPECT_EQ(s.width, 640);
  EXPECT_EQ(s.height, 480);
  EXPECT_EQ(s.format, PixelFormat::kMono12);
  EXPECT_FLOAT_EQ(static_cast<float>(s.exposure_us), 1234.0F);
  EXPECT_FLOAT_EQ(static_cast<float>(s.frame_rate_hz), 59.94F);
  EXPECT_EQ(s.packet_bytes, 8000);
  EXPECT_GT(rig.device->stats().test_packets, 0U);
}

class CaptureReopen : public ::testing::Test {
 protected:
  /// Sends frames from `id` on until capture delivers one; the number of seconds that took.
  double until_frames_come(CaptureRig& rig, std::uint64_t& id) {
    const Image image(320, 240, PixelFormat::kMono8, 9);
    const std::int64_t start = hil::monotonic_ns();
    while (seconds_since(start) < 20) {
      if (rig.device->streaming()) (void)rig.send(id++, image.view);
      CameraEvent event = rig.source->poll(Duration::from_ms(20));
      if (std::holds_alternative<CameraStarted>(event)) ++started;
      if (auto* lost = std::get_if<CameraLost>(&event)) reason = lost->reason;
      if (auto* frame = std::get_if<CameraFrame>(&event)) {
        last_seq = frame->info.seq;
        EXPECT_TRUE(same(frame->image, image));
        return seconds_since(start);
      }
    }
    ADD_FAILURE() << "no frame within 20 s";
    return 20;
  }
  int started{0};
  std::optional<LossReason> reason;
  std::uint64_t last_seq{0};
};

TEST_F(CaptureReopen, ACameraThatLostPowerStreamsAgainWithItsSettings) {
  CaptureRig rig;
  rig.open();
  std::uint64_t id = 1;
  (void)until_frames_come(rig, id);
  const std::uint64_t seq_before = last_seq;
  // WHEN it vanishes and is found lost
  rig.device->vanish(hil::Outage::kPower);
  const std::int64_t gone = hil::monotonic_ns();
  ASSERT_TRUE(rig.next<CameraLost>().has_value());
  RecordProperty("ms_until_found_lost", static_cast<int>(seconds_since(gone) * 1e3));
  EXPECT_EQ(rig.device->settings().width, 1024);  // it forgot
  ASSERT_TRUE(rig.device->reappear().ok());
  // THEN it is opened, configured and delivers again, numbers from 1
  id = 1;
  const double took = until_frames_come(rig, id);
  RecordProperty("ms_until_frames_again", static_cast<int>(took * 1e3));
  EXPECT_EQ(started, 1);
  EXPECT_EQ(rig.device->settings().width, 320);
  EXPECT_GT(last_seq, seq_before + 1);  // a gap shows that frames are lost
  EXPECT_EQ(rig.source->counters().starts, 2U);
  EXPECT_EQ(rig.source->counters().losses, 1U);
}

TEST_F(CaptureReopen, ACablePulledAndPutBackStreamsAgain) {
  CaptureRig rig;
  rig.open();
  std::uint64_t id = 1;
  (void)until_frames_come(rig, id);
  rig.device->vanish(hil::Outage::kCable);
  ASSERT_TRUE(rig.next<CameraLost>().has_value());
  ASSERT_TRUE(rig.device->reappear().ok());
  const double took = until_frames_come(rig, id);
  RecordProperty("ms_until_frames_again", static_cast<int>(took * 1e3));
  EXPECT_EQ(started, 1);
}

TEST_F(CaptureReopen, PollDoesNotBlockWhileTheCameraIsAwayAndFramesComeWhenItReturns) {
  CaptureRig rig;
  rig.open();
  rig.device->vanish(hil::Outage::kPower);
  ASSERT_TRUE(rig.next<CameraLost>().has_value());
  double longest = 0;
  for (int i = 0; i < 100; ++i) {
    const std::int64_t start = hil::monotonic_ns();
    EXPECT_FALSE(std::holds_alternative<CameraFrame>(rig.source->poll(Duration::from_ms(10))));
    longest = std::max(longest, seconds_since(start));
  }
  EXPECT_LT(longest, 2.0);  // closing takes as long, but elsewhere
  RecordProperty("longest_poll_ms", static_cast<int>(longest * 1e3));
  ASSERT_TRUE(rig.device->reappear().ok());
  std::uint64_t id = 1;
  RecordProperty("ms_until_frames_again", static_cast<int>(until_frames_come(rig, id) * 1e3));
  EXPECT_EQ(started, 1);
}

TEST_F(CaptureReopen, NumbersThatGoBackALittleAreFoundAndTheStreamIsOpenedAgain) {
  // GIVEN numbers that go back by less than a hundred, which the receiver ignores without a word
  CaptureRig rig;
  rig.open();
  std::uint64_t id = 50;
  (void)until_frames_come(rig, id);
  id = 1;
  (void)until_frames_come(rig, id);
  EXPECT_EQ(started, 1);
  EXPECT_EQ(reason, LossReason::kNumbersBack);
}

TEST_F(CaptureReopen, NumbersThatGoBackALotAreFoundAtOnce) {
  CaptureRig rig;
  rig.open();
  std::uint64_t id = 5000;
  (void)until_frames_come(rig, id);
  id = 1;
  (void)until_frames_come(rig, id);
  EXPECT_EQ(started, 1);
  EXPECT_EQ(reason, LossReason::kNumberJump);
}

TEST_F(CaptureReopen, AFrameHeldByAReaderOutlivesItsStream) {
  CaptureRig rig;
  rig.open();
  const Image sent(320, 240, PixelFormat::kMono8, 1);
  ASSERT_TRUE(rig.send(1, sent.view).sent);
  auto held = rig.next<CameraFrame>();
  ASSERT_TRUE(held.has_value());
  rig.device->vanish(hil::Outage::kPower);
  ASSERT_TRUE(rig.next<CameraLost>().has_value());
  ASSERT_TRUE(rig.device->reappear().ok());
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_TRUE(same(held->image, sent));
  held.reset();
  std::uint64_t id = 1;
  (void)until_frames_come(rig, id);
}

}  // namespace
}  // namespace cyclops::test
