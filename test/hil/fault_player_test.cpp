#include "hil/fault_player.hpp"

#include <gtest/gtest.h>

#include "hil/fault_camera.hpp"
#include "hil/fault_inputs.hpp"

namespace cyclops::hil {
namespace {

FaultScript script(const std::string& faults) {
  auto read = FaultScript::parse(faults, "test");
  EXPECT_TRUE(read.ok()) << read.error().message();
  return read.ok() ? std::move(read).value() : FaultScript{};
}

StrobeEdge edge(int n) { return {Time{1'000'000'000 + n * 33'333'333LL}, n, true}; }

TEST(FaultPlayer, AFaultIsOnFromItsOnsetToItsEndAndNeverAgain) {
  FaultPlayer player(script("[[fault]]\nkind = \"pps_loss\"\nonset_s = 2.0\nduration_s = 1.0\n"));
  int begun = 0, ended = 0;
  player.on_change([&](const Fault&, bool on) { ++(on ? begun : ended); });
  for (double t : {0.0, 1.9, 2.0, 2.9, 3.0, 3.1}) {
    player.advance(t, static_cast<std::int64_t>(t * 1e9));
    EXPECT_EQ(player.on(FaultKind::kPpsLoss) != nullptr, t >= 2.0 && t < 3.0) << t;
  }
  EXPECT_EQ(begun, 1);
  EXPECT_EQ(ended, 1);
  EXPECT_EQ(player.report()[0]["from_ns"], 2'000'000'000);
  EXPECT_EQ(player.report()[0]["until_ns"], 3'000'000'000);
}

TEST(FaultPlayer, AShareHitsThatManyAndTheSameOnesEachTime) {
  const std::string text = "[[fault]]\nkind = \"tspi_loss\"\nduration_s = 9.0\nshare = 0.3\naircraft = \"tanker\"\n";
  FaultPlayer one(script(text)), other(script(text));
  one.advance(0, 0);
  other.advance(0, 0);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool hit = one.strike(FaultKind::kTspiLoss, Aircraft::kTanker) != nullptr;
    EXPECT_EQ(hit, other.strike(FaultKind::kTspiLoss, Aircraft::kTanker) != nullptr);
    EXPECT_EQ(one.strike(FaultKind::kTspiLoss, Aircraft::kReceiver), nullptr);
    hits += hit ? 1 : 0;
  }
  EXPECT_NEAR(hits, 600, 80);
  EXPECT_EQ(one.report()[0]["struck"], hits);
}

TEST(FaultPlayer, AClockDriftsWhileTheFaultIsOnAndStaysWhereItIsAfterwards) {
  FaultPlayer player(script("[[fault]]\nkind = \"camera_clock_drift\"\nonset_s = 1.0\nduration_s = 2.0\nppm = 50\n"));
  InputFaults inputs(player);
  player.advance(2.0, 0);
  EXPECT_EQ(inputs.camera_tick(0), 50'000);
  player.advance(10.0, 0);
  EXPECT_EQ(inputs.camera_tick(0), 100'000);
}

TEST(InputFaults, AnEdgeLostOnTheWireLeavesNoGapInTheNumbersAndOneLostInTheBufferDoes) {
  for (const bool wire : {true, false}) {
    FaultPlayer player(script(std::string("[[fault]]\nkind = \"strobe_lost\"\nonset_s = 1.0\nduration_s = 1.0\nshare = 1.0\nwhere = \"") + (wire ? "wire" : "buffer") + "\"\n"));
    InputFaults inputs(player);
    std::vector<Delayed<StrobeEdge>> out;
    player.advance(0, 0);
    inputs.strobe(edge(1), out);
    ASSERT_EQ(out.size(), 1U);
    player.advance(1, 0);
    inputs.strobe(edge(2), out);
    EXPECT_TRUE(out.empty());
    player.advance(2, 0);
    inputs.strobe(edge(3), out);
    ASSERT_EQ(out.size(), 1U);
    EXPECT_EQ(out[0].item.line_seq, wire ? 2 : 3);
    EXPECT_EQ(out[0].item.t, edge(3).t);
  }
}

TEST(InputFaults, SpuriousAndDoubledEdgesComeInOrderOfTimeAndAreNumbered) {
  FaultPlayer player(script("[[fault]]\nkind = \"strobe_spurious\"\nduration_s = 9.0\nrate_hz = 60\n[[fault]]\nkind = \"strobe_doubled\"\nduration_s = 9.0\n"));
  InputFaults inputs(player);
  player.advance(0, 0);
  std::vector<Delayed<StrobeEdge>> out;
  Time last{};
  std::int64_t seq = 0;
  std::size_t all = 0;
  for (int n = 1; n <= 100; ++n) {
    inputs.strobe(edge(n), out);
    for (const auto& d : out) {
      EXPECT_GT(d.item.t, last);
      EXPECT_EQ(d.item.line_seq, ++seq);
      last = d.item.t;
    }
    all += out.size();
  }
  EXPECT_GT(all, 350U);  // 100 edges, 100 bounces, some 200 others
}

TEST(InputFaults, AFrozenStateKeepsItsTimeAndNumberGoing) {
  FaultPlayer player(script("[[fault]]\nkind = \"tspi_freeze\"\nduration_s = 1.0\naircraft = \"tanker\"\n"));
  InputFaults inputs(player);
  player.advance(0, 0);
  std::vector<Delayed<tspi_t>> out;
  tspi_t m{};
  for (int n = 0; n < 3; ++n) {
    m.seq = n;
    m.gps_time_ns = n * 1000;
    m.latitude_deg = n;
    inputs.tspi(Aircraft::kTanker, m, out);
    ASSERT_EQ(out.size(), 1U);
    EXPECT_EQ(out[0].item.seq, n);
    EXPECT_EQ(out[0].item.gps_time_ns, n * 1000);
    EXPECT_EQ(out[0].item.latitude_deg, 0);
  }
  player.advance(2, 0);
  inputs.tspi(Aircraft::kTanker, m, out);
  EXPECT_EQ(out[0].item.latitude_deg, 2);
}

TEST(CameraFaults, ATruncatedFrameLosesTheSamePacketsWhenTheyAreSentAgain) {
  FaultPlayer player(script("[[fault]]\nkind = \"frame_truncated\"\nduration_s = 1.0\nkeep = 0.5\n"));
  CameraFaults camera(player);
  player.advance(0, 0);
  for (const bool again : {false, true})
    for (std::uint32_t id = 0; id < 10; ++id) EXPECT_EQ(camera.packet({1, id, 10, again}), id < 5 ? PacketFate::kSend : PacketFate::kDrop);
  player.advance(2, 0);
  EXPECT_EQ(camera.packet({1, 9, 10, true}), PacketFate::kDrop);   // what was doomed stays so
  EXPECT_EQ(camera.packet({2, 9, 10, false}), PacketFate::kSend);
}

TEST(CameraFaults, AFrozenPictureIsTheLastOneBeforeTheFault) {
  FaultPlayer player(script("[[fault]]\nkind = \"frame_frozen\"\nonset_s = 1.0\nduration_s = 1.0\n"));
  CameraFaults camera(player);
  std::uint8_t one[4] = {1, 2, 3, 4}, two[4] = {5, 6, 7, 8};
  player.advance(0, 0);
  EXPECT_EQ(camera.picture({one, 2, 2, 2, PixelFormat::kMono8}, 1).data[3], 4);
  player.advance(1, 0);
  EXPECT_EQ(camera.picture({two, 2, 2, 2, PixelFormat::kMono8}, 1).data[3], 4);
  EXPECT_EQ(camera.picture({two, 2, 2, 2, PixelFormat::kMono8}, 0.5).data[3], 2);
  player.advance(2, 0);
  EXPECT_EQ(camera.picture({two, 2, 2, 2, PixelFormat::kMono8}, 1).data[3], 8);
}

}  // namespace
}  // namespace cyclops::hil
