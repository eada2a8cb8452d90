#include "service/recorder.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "record/flight.hpp"
#include "record/scan.hpp"
#include "service/recorded_front.hpp"
#include "test/support.hpp"
#include "test/wire/examples.hpp"
#include "tools/sortie_check.hpp"

namespace cyclops {
namespace {

namespace fs = std::filesystem;

class RecorderTest : public testing::Test {
 protected:
  RecorderTest() {
    fs::create_directories(dir_.path() / "rig" / "models");
    std::ofstream(dir_.file("rig/models/points.csv")) << "id,x,y,z\n1,0,0,0\n";
    std::ofstream(dir_.file("rig/rig.toml")) << "# comments stay\n[camera]\nwidth_px = 64\nheight_px = 48\npixel_format = \"mono12\"\n[tanker]\nmodel = \"models/points.csv\"\n[strobe]\nsource = \"none\"\n";
    options_.folder = dir_.file("out");
    options_.name = "one";
    options_.reserve_bytes = 0;
  }
  std::unique_ptr<Recorder> start(bool own_clock = false) {
    auto rig = Rig::load(dir_.file("rig/rig.toml"));
    EXPECT_TRUE(rig.ok());
    rig_ = *rig;
    auto r = Recorder::start(options_, rig_, "a profile", "", own_clock, events_);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().message());
    return r.ok() ? std::move(r).value() : nullptr;
  }
  static ArrivedTspi tspi(Time arrival) {
    ArrivedTspi t{test::good_report(), arrival, {}};
    for (const std::uint8_t b : test::bytes_of(test::good_tspi())) t.bytes.push_back(b);
    return t;
  }
  [[nodiscard]] std::vector<record::LogEvent> inputs() const {
    std::vector<record::LogEvent> out;
    EXPECT_TRUE(record::scan_log(dir_.file("out/one/messages.lcm"), [&](const record::LogEvent& e) { out.push_back(e); }).ok());
    return out;
  }
  test::TempDir dir_;
  RecordOptions options_;
  EventBus events_;
  Rig rig_;
};

TEST_F(RecorderTest, MakesAFlightThatLoadsWithTheRigAndItsFiles) {
  auto recorder = start();
  ASSERT_TRUE(recorder);
  recorder->published(channel::kEvent, "abc", 3);
  ASSERT_TRUE(recorder->stop().ok());
  const std::string folder = dir_.file("out/one");
  const auto flight = FlightReader::open(folder);
  ASSERT_TRUE(flight.ok()) << flight.error().message();
  EXPECT_EQ(flight->manifest().origin, "recorded");
  EXPECT_EQ(flight->manifest().frames, 0);
  const auto rig = Rig::load(flight->path("rig.toml"));
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_EQ(rig->files[0].as_written, "points.csv");
  EXPECT_EQ(rig->device.format, PixelFormat::kMono12);
  std::ostringstream text;
  text << std::ifstream(folder + "/rig.toml").rdbuf();
  EXPECT_EQ(text.str().substr(0, 16), "# comments stay\n") << "as written, but for the path";
  const auto head = record::read_sortie(folder);
  ASSERT_TRUE(head.ok()) << head.error().message();
  EXPECT_EQ(head->sha256.size(), 2U);
  EXPECT_EQ(head->program_sha256.size(), 64U);
  const auto report = tools::check_sortie(folder);
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->problems.empty()) << report->problems[0];
}

TEST_F(RecorderTest, NeverWritesOverASortie) {
  fs::create_directories(dir_.file("out/one"));
  const auto rig = Rig::load(dir_.file("rig/rig.toml")).value();
  const auto r = Recorder::start(options_, rig, "", "", false, events_);
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().message().find("is there already"), std::string::npos) << r.error().message();
}

TEST_F(RecorderTest, KeepsInputsInTheOrderInWhichTheFrontUsedThem) {
  // GIVEN a front that records WHEN everything a flight has goes in
  auto recorder = start();
  ASSERT_TRUE(recorder);
  static std::int64_t host = 0;
  host = 5'000'000'999;
  RecordedFront front(Front(rig_.stamper, rig_.gps, NavConfig{}, rig_.nav), recorder.get(), false, [] { return host; });
  front.restart(Time{INT64_MIN});
  front.push(StrobeEdge{Time{123}, 7, true});
  front.push(TimeMark{Time{1000}, GpsTime{2000}, Duration{30}});
  front.push(tspi(Time{4'999'000'000}));
  FrameInfo info;
  info.camera_frame_id = 3;
  info.t_arrival = Time{77};
  info.exposure = Duration{4'000'000};
  info.status = FrameStatus::kComplete;
  std::int64_t number = -1;
  ASSERT_TRUE(front.push(info, 0, number));
  EXPECT_EQ(number, 0);
  front.flush();
  ASSERT_TRUE(recorder->stop().ok());
  // THEN the record has each, in this order, with the bytes of the TSPI message and its arrival
  const auto got = inputs();
  const char* expected[] = {channel::kAcquisition, channel::kStrobe, channel::kTimeMark, channel::kTspiTanker, channel::kFrame, channel::kAcquisition};
  ASSERT_EQ(got.size(), std::size(expected));
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].channel, expected[i]);
    EXPECT_EQ(got[i].number, static_cast<std::int64_t>(i));
    EXPECT_EQ(got[i].time_us, i == 3 ? 4'999'000 : 5'000'000) << i;
  }
  EXPECT_EQ(decode_acquisition(got[0].data.data(), got[0].data.size())->t.ns, INT64_MIN);
  EXPECT_EQ(decode_strobe_edge(got[1].data.data(), got[1].data.size())->edge.line_seq, 7);
  EXPECT_EQ(got[3].data, test::bytes_of(test::good_tspi()));
  const auto frame = decode_frame_index(got[4].data.data(), got[4].data.size());
  ASSERT_TRUE(frame.ok()) << frame.error().message();
  EXPECT_EQ(frame->recorded_at, 0);
  EXPECT_EQ(frame->info.t_arrival.ns, 77);
  EXPECT_EQ(decode_acquisition(got[5].data.data(), got[5].data.size())->what, AcquisitionChange::kSilent);
}

TEST_F(RecorderTest, OnABenchEverythingIsOnTheClockOfTheBench) {
  auto recorder = start(true);
  ASSERT_TRUE(recorder);
  RecordedFront front(Front(rig_.stamper, rig_.gps, NavConfig{}, rig_.nav), recorder.get(), true, [] { return std::int64_t{1}; });
  front.restart(Time{INT64_MIN});        // the time is not known yet
  front.push(tspi(Time{4'999'000'000}));
  front.push(StrobeEdge{Time{9'000'000'000'123}, 7, true});
  front.push(tspi(Time{4'999'000'000}));
  ASSERT_TRUE(recorder->stop().ok());
  const char* expected[] = {channel::kAcquisition, channel::kTspiTanker, channel::kStrobe, channel::kTspiTanker};
  const auto got = inputs();
  ASSERT_EQ(got.size(), std::size(expected));
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].channel, expected[i]);
    EXPECT_EQ(got[i].time_us, 9'000'000'000) << i;
  }
}

TEST_F(RecorderTest, VerifyNamesTheFrameWhosePixelsAreNotThere) {
  auto recorder = start();
  ASSERT_TRUE(recorder);
  FrameInfo info;
  info.camera_frame_id = 1;
  info.status = FrameStatus::kComplete;
  for (int i = 0; i < 3; ++i) (void)recorder->frame(Time{1000}, info);
  ASSERT_TRUE(recorder->stop().ok());
  const auto report = tools::check_sortie(dir_.file("out/one"));
  ASSERT_TRUE(report.ok());
  ASSERT_EQ(report->problems.size(), 1U);
  EXPECT_EQ(report->problems[0], "3 frames have no pixels: 0 to 2");
}

TEST_F(RecorderTest, SaysThatTheDiskIsFullAndTakesNoMorePixels) {
  // GIVEN a reserve that no disk has
  options_.reserve_bytes = std::int64_t{1} << 60;
  auto recorder = start();
  ASSERT_TRUE(recorder);
  EXPECT_FALSE(recorder->has_room());
  EXPECT_EQ(recorder->counts().disk_left_min, 0.0F);
  const auto event = events_.next();
  ASSERT_TRUE(event.has_value());
  EXPECT_STREQ(event->code.data(), "record.disk_full");
  EXPECT_EQ(event->level, EventLevel::kFault);
  EXPECT_FALSE(events_.next().has_value()) << "once";
  // AND messages are still recorded
  recorder->published(channel::kEvent, "abc", 3);
  ASSERT_TRUE(recorder->stop().ok());
  EXPECT_EQ(tools::check_sortie(dir_.file("out/one"))->published.events, 1);
}

}  // namespace
}  // namespace cyclops
