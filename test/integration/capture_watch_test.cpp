// A camera that streams and yet is not right: it is silent, changes its settings, or repeats a picture.
#include "test/integration/capture_rig.hpp"

namespace cyclops::test {
namespace {

TEST(CaptureWatch, ACameraThatIsThereButSendsNothingIsAskedMoreAndMoreSeldom) {
  CaptureRig rig;
  rig.config.watchdog_least = Duration::from_ms(100);
  rig.open();
  Duration before{};
  for (int stream = 0; stream < 3; ++stream) {
    const auto lost = rig.next<CameraLost>();
    ASSERT_TRUE(lost.has_value());
    EXPECT_EQ(lost->reason, LossReason::kSilence);
    EXPECT_GE(lost->silence, rig.config.patience(stream));  // a busy machine may take longer, never less
    EXPECT_GT(rig.config.patience(stream), before);
    before = rig.config.patience(stream);
    ASSERT_TRUE(rig.next<CameraStarted>().has_value());
  }
  // WHEN frames come again THEN patience is what it was at first
  const Image image(320, 240, PixelFormat::kMono8, 1);
  ASSERT_TRUE(rig.send(1, image.view).sent);
  ASSERT_TRUE(rig.next<CameraFrame>().has_value());
  const auto lost = rig.next<CameraLost>();
  ASSERT_TRUE(lost.has_value());
  EXPECT_EQ(lost->reason, LossReason::kSilence);
}

TEST(CaptureWatch, ASettingThatChangesWhileTheCameraStreamsIsFoundAndSetAgain) {
  for (const bool exposure : {true, false}) {
    CaptureRig rig;
    rig.config.verify_every = Duration::from_ms(50);
    rig.config.watchdog_least = Duration::from_seconds(5);
    rig.open();
    if (exposure) rig.device->change_settings(1500.0, {});
    else rig.device->change_settings({}, 12.0);
    const auto lost = rig.next<CameraLost>();
    ASSERT_TRUE(lost.has_value());
    EXPECT_EQ(lost->reason, LossReason::kSettings);
    EXPECT_NE(lost->detail.find(exposure ? "ExposureTime: is 1500, expected 4000" : "AcquisitionFrameRate: is 12, expected 30"), std::string::npos) << lost->detail;
    ASSERT_TRUE(rig.next<CameraStarted>().has_value());
    EXPECT_FLOAT_EQ(static_cast<float>(rig.device->settings().exposure_us), 4000.0F);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.device->settings().frame_rate_hz), 30.0F);
  }
}

TEST(CaptureWatch, APictureThatComesAgainAndAgainIsNotBelieved) {
  CaptureRig rig;
  rig.config.frozen_after = 2;
  rig.open();
  const Image one(320, 240, PixelFormat::kMono8, 1), two(320, 240, PixelFormat::kMono8, 2);
  std::uint64_t id = 0;
  // GIVEN the same picture three times: two repeats are believed
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(rig.send(++id, one.view).sent);
    const auto frame = rig.next<CameraFrame>();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->info.status, FrameStatus::kComplete);
  }
  // THEN those after them are frames without pixels, and the first of them is a fault
  std::optional<CameraFrame> frame;
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(rig.send(++id, one.view).sent);
    frame = rig.next<CameraFrame>();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->info.status, FrameStatus::kMissing);
    EXPECT_EQ(frame->image.data, nullptr);
    EXPECT_EQ(frame->info.seq, id);
    if (i > 0) continue;
    const auto fault = rig.next<CameraFault>();
    ASSERT_TRUE(fault.has_value());
    EXPECT_NE(fault->error.what.find("bit for bit"), std::string::npos);
  }
  // WHEN the picture changes THEN all is well
  ASSERT_TRUE(rig.send(++id, two.view).sent);
  frame = rig.next<CameraFrame>();
  ASSERT_TRUE(frame.has_value());
  EXPECT_TRUE(same(frame->image, two));
  EXPECT_EQ(rig.source->counters().lost_frozen, 2U);
  EXPECT_EQ(rig.source->counters().received, 4U);
}

}  // namespace
}  // namespace cyclops::test
