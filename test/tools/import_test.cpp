#include "tools/import.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include <opencv2/imgcodecs.hpp>

#include "record/flight.hpp"
#include "service/front.hpp"
#include "service/rig.hpp"
#include "estimate/estimate.hpp"
#include "test/support.hpp"
#include "wire/codec.hpp"

namespace cyclops::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 12, kWidth = 64, kHeight = 48;

/// A folder as cyclops-import takes it: pictures of noise, four features, a prior that turns and comes nearer.
class ImportTest : public ::testing::Test {
 protected:
  ImportTest() {
    fs::create_directories(dir_.file("in/frames"));
    options_.folder = dir_.file("in");
    options_.out = dir_.file("flight");
    spill("camera.json", R"({"width": 64, "height": 48, "fx": 80.0, "fy": 81.0, "cx": 31.0, "cy": 24.0, "k1": -0.1})");
    spill("features.csv", "id,x_m,y_m,z_m\n1,-1,-1,0\n2,1,-1,0.5\n3,1,1,0\n9,-1,1,-0.5\n");
    for (int k = 0; k < kFrames; ++k) picture(k, kWidth, kHeight);
    write_prior();
  }
  void spill(const std::string& name, const std::string& text) { std::ofstream(dir_.file("in/" + name)) << text; }
  void picture(int k, int width, int height) {
    cv::Mat image(height, width, CV_8UC1);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(17 * u + 31 * v + 7 * k);
    char name[32];
    std::snprintf(name, sizeof name, "in/frames/f_%03d.png", k);
    ASSERT_TRUE(cv::imwrite(dir_.file(name), image));
  }
  static Pose<frame::C, frame::M> pose(int k) {
    const Eigen::Quaterniond q = so3_exp({0.02 * k, 0.3 - 0.05 * k, 0.1 * k});
    return {Rotation<frame::C, frame::M>(q), Point<frame::C>(0.3 - 0.05 * k, 0.02 * k, 9.0 - 0.2 * k)};
  }
  void write_prior() {
    std::ofstream out(dir_.file("in/prior.csv"));
    out.precision(17);
    out << "frame,timestamp_s,x,y,z,qw,qx,qy,qz,nav_update\n";
    for (int k = 0; k < kFrames; ++k) {
      const auto p = pose(k);
      const auto& q = p.rotation().quaternion();
      const Vec3& t = p.translation().xyz;
      out << k << "," << start_s_ + k / 20.0 << "," << t.x() << "," << t.y() << "," << t.z() << "," << q.w() << "," << q.x() << "," << q.y() << "," << q.z() << "," << (k % 4 == 0 ? 1 : 0) << "\n";
    }
  }
  std::string error() {
    const auto r = import_folder(options_);
    if (r.ok()) return "no error";
    EXPECT_FALSE(FlightReader::open(options_.out).ok()) << "what is left of it is no flight";
    return r.error().message();
  }
  /// Largest distance on the image between the prior and what navigation makes of the flight's TSPI.
  void check_poses(double most_px);

  test::TempDir dir_;
  ImportOptions options_;
  double start_s_{0};
};

void ImportTest::check_poses(double most_px) {
  auto flight = FlightReader::open(options_.out).value();
  const Rig rig = Rig::load(flight.path("rig.toml")).value();
  const CameraMount mount{camera_from_receiver(rig.mount_angles), rig.lens, 0};
  auto front = std::make_unique<Front>(rig.stamper, rig.gps, NavConfig{}, rig.nav);
  front->restart(Time{INT64_MIN});
  auto predictions = std::make_unique<PredictionSet>();
  record::LogEvent e;
  int seen = 0;
  const auto look = [&] {
    for (AlignedFrame ready; front->pop(ready); ++seen) {
      ASSERT_TRUE(ready.nav.state.valid) << seen << ": " << static_cast<int>(ready.nav.absence);
      EXPECT_EQ(ready.frame.time_source, TimeSource::kStrobe);
      predict(ready.nav.state, rig.tanker, rig.camera, mount, {}, *predictions);
      ASSERT_EQ(predictions->items.size(), 4U);
      for (std::size_t i = 0; i < 4; ++i) {
        const auto expected = rig.camera.project(pose(seen) * rig.tanker.features()[i].p_m);
        ASSERT_TRUE(expected.has_value());
        EXPECT_NEAR((predictions->items[i].uv_px - *expected).norm(), 0, most_px) << "frame " << seen << ", feature " << i;
      }
    }
  };
  while (flight.next(e).value()) {
    const auto* data = e.data.data();
    const std::size_t n = e.data.size();
    if (e.channel == channel::kTimeMark) front->push(decode_time_mark(data, n).value().mark);
    if (e.channel == channel::kStrobe) front->push(decode_strobe_edge(data, n).value().edge);
    for (const Aircraft a : {Aircraft::kReceiver, Aircraft::kTanker}) {
      if (e.channel != (a == Aircraft::kReceiver ? channel::kTspiReceiver : channel::kTspiTanker)) continue;
      EXPECT_EQ(front->push(decode_tspi(data, n, a).value(), Time{e.time_us * 1000}), TspiVerdict::kPass);
    }
    if (e.channel == channel::kFrame) {
      FrameInfo info = decode_frame_index(data, n).value().info;
      info.t_mid = {};
      info.time_source = TimeSource::kUnknown;
      ASSERT_TRUE(front->push(info, 0));
    }
    look();
  }
  front->flush();
  look();
  EXPECT_EQ(seen, kFrames);
}

TEST_F(ImportTest, ThePriorComesBackThroughGeodeticTspi) {
  // GIVEN a prior that turns and comes nearer WHEN it has been TSPI of two aircraft over the ellipsoid
  const auto report = import_folder(options_);
  ASSERT_TRUE(report.ok()) << report.error().message();
  EXPECT_EQ(report->frames, kFrames);
  EXPECT_EQ(report->nav_every_n, 4);
  EXPECT_EQ(report->features, 4U);
  EXPECT_FALSE(report->has_truth);
  // THEN navigation gives the same pixels to a thousandth
  check_poses(1e-3);
}

TEST_F(ImportTest, TimestampsMayBeSecondsSince1970) {
  start_s_ = 1'700'000'000.25;
  write_prior();
  const auto report = import_folder(options_);
  ASSERT_TRUE(report.ok()) << report.error().message();
  check_poses(1e-3);
}

TEST_F(ImportTest, KeepsPixelsBitForBit) {
  ASSERT_TRUE(import_folder(options_).ok());
  auto flight = FlightReader::open(options_.out).value();
  std::vector<std::uint8_t> memory;
  FlightFrame frame;
  ASSERT_TRUE(flight.frame(5, memory, frame).ok());
  EXPECT_EQ(frame.camera_frame_id, 6U);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) ASSERT_EQ(frame.image.row8(v)[u], static_cast<std::uint8_t>(17 * u + 31 * v + 35)) << u << " " << v;
}

TEST_F(ImportTest, TruthIsTakenAlong) {
  spill("truth.csv", "frame,id,u_px,v_px,visible\n0,1,10.5,20.25,1\n0,9,11,12,2\n");
  const auto report = import_folder(options_);
  ASSERT_TRUE(report.ok()) << report.error().message();
  EXPECT_TRUE(report->has_truth);
  auto flight = FlightReader::open(options_.out).value();
  record::LogEvent e;
  auto truth = std::make_unique<Truth>();
  int n = 0;
  while (flight.next(e).value())
    if (e.channel == channel::kTruth) {
      ASSERT_TRUE(decode_truth(e.data.data(), e.data.size(), *truth).ok());
      EXPECT_EQ(truth->points.size(), 2u);
      EXPECT_FALSE(truth->has_pose || truth->has_detail) << "truth.csv holds only pixels";
      EXPECT_EQ(truth->exposure.ns, 0);
      EXPECT_EQ(truth->sun_c, Vec3(0, 0, 0));
      ++n;
    }
  EXPECT_EQ(n, 1) << "one frame has truth";
}

TEST_F(ImportTest, CountsTheFramesThatATruthFileLeavesOut) {
  // GIVEN no truth.csv THEN no frame is said to be without
  EXPECT_EQ(import_folder(options_).value().frames_without_truth, 0);
  // GIVEN rows of three frames, one of them hidden, and of a frame that the prior does not know
  spill("truth.csv", "frame,id,u_px,v_px,visible\n0,1,10.5,20.25,1\n0,9,11,12,2\n7,1,1,2,0\n11,1,1,2,1\n99,1,1,2,1\n");
  // THEN the other nine are counted
  EXPECT_EQ(import_folder(options_).value().frames_without_truth, kFrames - 3);
}

TEST_F(ImportTest, NamesThePictureThatIsMissing) {
  fs::remove(dir_.file("in/frames/f_007.png"));
  EXPECT_EQ(error(), dir_.file("in") + "/frames: no picture for frame 7 of the prior");
}

TEST_F(ImportTest, NamesThePictureOfAnotherSize) {
  picture(3, kWidth, kHeight + 1);
  EXPECT_EQ(error(), dir_.file("in/frames/f_003.png") + ": is 64 x 49 px, expected 64 x 48 by camera.json");
}

TEST_F(ImportTest, NamesThePictureThatIsNone) {
  std::ofstream(dir_.file("in/frames/f_002.png")) << "no picture";
  EXPECT_EQ(error(), dir_.file("in/frames/f_002.png") + ": is no picture that can be read");
}

TEST_F(ImportTest, NamesTwoPicturesWithOneNumber) {
  fs::copy_file(dir_.file("in/frames/f_002.png"), dir_.file("in/frames/g_002.png"));
  EXPECT_EQ(error(), dir_.file("in/frames/g_002.png") + ": has the same frame number as another picture");
}

TEST_F(ImportTest, NamesTheLineOfACellThatIsNoNumber) {
  spill("prior.csv", "frame,x,y,z,qw,qx,qy,qz\n0,0,0,9,1,0,0,0\n1,0,near,9,1,0,0,0\n");
  EXPECT_EQ(error(), dir_.file("in/prior.csv") + ":3: y is \"near\", expected a finite number");
  spill("prior.csv", "frame,x,y,z,qw,qx,qy,qz\n0,0,0,9,1,0,0\n");
  EXPECT_EQ(error(), dir_.file("in/prior.csv") + ":2: has 7 cells, expected 8");
  spill("prior.csv", "frame,x,y,z,qw,qx,qy,qz\n0,0,0,9,2,0,0,0\n");
  EXPECT_EQ(error().rfind(dir_.file("in/prior.csv") + ":2: quaternion has length 2.0", 0), 0U);
  spill("prior.csv", "frame,x,y,z\n0,0,0,9\n");
  EXPECT_EQ(error(), dir_.file("in/prior.csv") + ":1: header has no column qw");
}

TEST_F(ImportTest, NamesTheLineWhereTimeDoesNotGoOn) {
  const std::string head = "frame,timestamp_s,x,y,z,qw,qx,qy,qz\n";
  spill("prior.csv", head + "0,1.0,0,0,9,1,0,0,0\n1,1.0,0,0,9,1,0,0,0\n");
  EXPECT_EQ(error().rfind(dir_.file("in/prior.csv") + ":3: time does not go on", 0), 0U);
  spill("prior.csv", head + "0,1e12,0,0,9,1,0,0,0\n");
  EXPECT_EQ(error().rfind(dir_.file("in/prior.csv") + ":2: timestamp_s is ", 0), 0U);
  spill("prior.csv", head + "0,0,0,0,9,1,0,0,0\n1,3601,0,0,9,1,0,0,0\n");
  EXPECT_EQ(error().rfind(dir_.file("in/prior.csv") + ":3: ", 0), 0U) << "more than an hour";
}

TEST_F(ImportTest, RefusesAModelBehindTheCamera) {
  spill("prior.csv", "frame,x,y,z,qw,qx,qy,qz\n0,0,0,-9,1,0,0,0\n");
  EXPECT_EQ(error(), "prior.csv: frame 0: the model is behind the camera");
}

TEST_F(ImportTest, NamesTheFileThatIsMissing) {
  for (const char* name : {"prior.csv", "features.csv", "camera.json"}) {
    fs::remove(dir_.file(std::string("in/") + name));
    EXPECT_EQ(error(), dir_.file(std::string("in/") + name) + ": cannot be opened");
  }
  options_.folder = dir_.file("nowhere");
  EXPECT_EQ(error(), dir_.file("nowhere/camera.json") + ": cannot be opened");
}

TEST_F(ImportTest, TruthThatTheUserNamedMustBeThere) {
  options_.truth = "other.csv";
  options_.truth_required = true;
  EXPECT_EQ(error(), dir_.file("in/other.csv") + ": cannot be opened");
  spill("other.csv", "frame,id,u_px,v_px,visible\n0,1,1,1,3\n");
  EXPECT_EQ(error(), dir_.file("in/other.csv") + ":2: visible is 3, expected 0, 1 or 2");
  spill("other.csv", "frame,id,u_px,v_px\n0,1e10,1,1\n");
  EXPECT_EQ(error(), dir_.file("in/other.csv") + ":2: id is 10000000000, expected a 32-bit number");
}

TEST_F(ImportTest, NamesWhatIsWrongWithTheCamera) {
  const std::string path = dir_.file("in/camera.json");
  spill("camera.json", R"({"width": 64, "height": 48, "fx": 0, "fy": 81.0, "cx": 31.0, "cy": 24.0})");
  EXPECT_EQ(error(), path + ": fx and fy must be above 0");
  spill("camera.json", R"({"width": 1e300, "height": 48, "fx": 1, "fy": 81.0, "cx": 31.0, "cy": 24.0})");
  EXPECT_EQ(error(), path + ": width and height must be whole numbers from 16 to 4096");
  for (const char* text : {"", "{", "[]", "{}", R"({"width": "wide"})"}) {
    spill("camera.json", text);
    EXPECT_EQ(error().rfind(path + ": ", 0), 0U) << text;
  }
}

}  // namespace
}  // namespace cyclops::tools
