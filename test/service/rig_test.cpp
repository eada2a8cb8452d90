#include "service/rig.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "test/support.hpp"

namespace cyclops {
namespace {

/// The example of docs/architecture.md, by table.
struct Text {
  std::string camera = "address = \"10.0.0.7\"\nwidth_px = 640\nheight_px = 480\npixel_format = \"mono12\"\nframe_rate_hz = 25.0\nexposure_us = 2000.0\n";
  std::string mount = "pan_deg = 1.0\ntilt_deg = 16.0\nroll_deg = -2.0\nlens_in_receiver_m = [2.4, 0.0, -0.6]\nboresight_sigma_deg = 0.1\n";
  std::string tanker = "model = \"tanker.csv\"\nunit = \"in\"\nins = [190.0, 0.0, 95.0]\n";
  std::string strobe = "source = \"gpio\"\nline = 4\nedge = \"falling\"\ndelay_us = 12.5\n";
  std::string tspi = "tanker_ins_m = [0.0, 1.0, 0.0]\n";
  std::string time = "gps_from = \"arrival\"\n";
};

class RigTest : public ::testing::Test {
 protected:
  RigTest() { std::ofstream(dir_.file("tanker.csv")) << "id,x,y,z\n7,290,0,95\n8,290,100,95\n"; }
  Result<Rig> load(const Text& t) {
    std::ofstream(dir_.file("rig.toml")) << "[camera]\n" << t.camera << "[mount]\n" << t.mount << "[tanker]\n" << t.tanker << "[strobe]\n" << t.strobe
                                         << "[tspi]\n" << t.tspi << "[time]\n" << t.time;
    return Rig::load(dir_.file("rig.toml"));
  }
  /// Error of a rig with one more line in [camera].
  std::string camera_error(const std::string& line) {
    Text t;
    t.camera += line + "\n";
    const auto rig = load(t);
    return rig.ok() ? "no error" : rig.error().message();
  }
  test::TempDir dir_;
};

TEST_F(RigTest, ReadsEveryTable) {
  const auto rig = load({});
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_EQ(rig->device.address, "10.0.0.7");
  EXPECT_EQ(rig->device.format, PixelFormat::kMono12);
  EXPECT_EQ(rig->device.width_px, 640);
  EXPECT_EQ(rig->camera.intrinsics().height, 480);
  EXPECT_EQ(rig->camera.intrinsics().cx_px, 319.5) << "the middle, when it is not given";
  EXPECT_NEAR(rig->mount_angles.tilt, 0.27925268, 1e-8);
  EXPECT_EQ(rig->lens.xyz, Vec3(2.4, 0, -0.6));
  EXPECT_NEAR(rig->boresight_sigma_rad, 1.745329e-3, 1e-9);
  EXPECT_EQ(rig->strobe.kind, StrobeKind::kGpio);
  EXPECT_FALSE(rig->strobe.rising);
  EXPECT_TRUE(rig->gps.use_arrival);
  EXPECT_EQ(rig->nav.tanker_ins_from_tspi_m, Vec3(0, 1, 0));
}

TEST_F(RigTest, ReadsTheTankerInItsOwnUnitsFromTheFoldersOwnFile) {
  const auto rig = load({});
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  ASSERT_EQ(rig->tanker.features().size(), 2U);
  // 100 in aft of the INS is 2.54 m behind it in the body
  const Point<frame::K> p = rig->tanker.in_body(rig->tanker.features()[0]);
  EXPECT_NEAR(p.xyz.x(), -2.54, 1e-12);
  EXPECT_NEAR(p.xyz.z(), 0, 1e-12);
}

TEST_F(RigTest, HandsPeriodEdgeAndDelayToTheStamper) {
  const auto rig = load({});
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_EQ(rig->stamper.period.ns, 40'000'000);
  EXPECT_EQ(rig->stamper.edge_delay.ns, 12'500);
  EXPECT_FALSE(rig->stamper.rising);
  EXPECT_LE(rig->stamper.residual_max.ns, rig->stamper.period.ns / 8);
}

TEST_F(RigTest, ReadsTheLineOfPpsAndHandsItToTheClocks) {
  Text t;
  t.strobe += "delay_sigma_us = 3.0\n[pps]\nsource = \"gpio\"\nline = 5\ndelay_us = 40.0\ndelay_sigma_us = 4.0\n";
  t.time = "gps_from = \"pps\"\nclock_wander_ppm = 0.2\n";
  const auto rig = load(t);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_TRUE(rig->gps.use_pps);
  EXPECT_EQ(rig->pps.line, 5);
  EXPECT_EQ(rig->pps_marks.delay.ns, 40'000);
  EXPECT_EQ(rig->pps_marks.delay_sigma.ns, 4'000);
  EXPECT_EQ(rig->stamper.delay_sigma.ns, 3'000);
  EXPECT_EQ(rig->gps.clock.wander_per_rs, 0.2e-6);
}

TEST_F(RigTest, RefusesPpsWithoutALineAndOnTheLineOfTheStrobe) {
  EXPECT_EQ(load({})->pps.kind, StrobeKind::kNone);
  Text t;
  t.time = "gps_from = \"pps\"\n";
  EXPECT_NE(load(t).error().message().find("time.gps_from: is \"pps\", expected [pps] with source"), std::string::npos);
  t.strobe += "[pps]\nsource = \"gpio\"\nline = 4\n";
  EXPECT_NE(load(t).error().message().find("pps.line: is that of the strobe"), std::string::npos);
}

TEST_F(RigTest, TakesAFocalLengthInMillimetresInsteadOfPixels) {
  Text t;
  t.camera += "focal_mm = 12.5\npitch_um = 12.0\n";
  const auto rig = load(t);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_NEAR(rig->camera.intrinsics().fx_px, 1041.6667, 1e-3);
  EXPECT_EQ(rig->camera.intrinsics().fx_px, rig->camera.intrinsics().fy_px);
  EXPECT_NE(camera_error("focal_mm = 12.5\nfx_px = 1041.0").find("focal_mm: stands beside fx_px"), std::string::npos);
}

TEST_F(RigTest, NamesFileAndLineOfWhatIsWrong) {
  const std::string rig = dir_.file("rig.toml");
  EXPECT_EQ(camera_error("lens = 3"), rig + ":8: camera.lens: unknown key");
  EXPECT_EQ(camera_error("fx_px = 0.0"), rig + ":8: camera.fx_px: is 0, expected 1 to 1e+06");
  EXPECT_EQ(camera_error("cx_px = nan"), rig + ":8: camera.cx_px: is nan, expected -100000 to 100000");
  EXPECT_EQ(camera_error("k1 = \"none\"").rfind(rig + ":8: camera.k1: ", 0), 0U);
  Text t;
  t.mount = "lens_in_receiver_m = [1.0, 2.0]\n";
  EXPECT_EQ(load(t).error().message(), rig + ":9: mount.lens_in_receiver_m: expected three numbers below 100000");
  t = {};
  t.camera = "width_px = 5000\n";
  EXPECT_EQ(load(t).error().message(), rig + ":2: camera.width_px: is 5000, expected 16 to 4096");
  t = {};
  t.tspi = "tanker_ins_m = [0.0, 1000.0, 0.0]\n";
  EXPECT_NE(load(t).error().message().find("tspi.tanker_ins_m: expected three numbers below 100"), std::string::npos);
}

TEST_F(RigTest, NeedsATankerModel) {
  Text t;
  t.tanker = "unit = \"m\"\n";
  EXPECT_NE(load(t).error().message().find("tanker.model: required key is missing"), std::string::npos);
  t.tanker = "model = \"no.csv\"\n";
  EXPECT_EQ(load(t).error().message(), dir_.file("no.csv") + ": cannot be opened");
  std::ofstream(dir_.file("bad.csv")) << "id,x,y,z\n1,0,zero,0\n";
  t.tanker = "model = \"bad.csv\"\n";
  EXPECT_EQ(load(t).error().message(), dir_.file("bad.csv") + ":2: y is \"zero\", expected a finite number");
}

TEST_F(RigTest, TakesAWindscreenAndRefusesABrokenOne) {
  const auto grid = Windscreen::from_grids(2, 3, 320, std::vector<float>(6, 1.5F), std::vector<float>(6, -2.0F)).value();
  ASSERT_TRUE(grid.save(dir_.file("w.bin")).ok());
  Text t;
  t.camera += "windscreen = \"w.bin\"\n";
  auto rig = load(t);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_EQ(rig->camera.windscreen().delta({10, 10}), Vec2(1.5, -2));
  const auto size = std::filesystem::file_size(dir_.file("w.bin"));
  for (std::uintmax_t n = 0; n < size; ++n) {
    ASSERT_TRUE(grid.save(dir_.file("w.bin")).ok());
    std::filesystem::resize_file(dir_.file("w.bin"), n);
    rig = load(t);
    ASSERT_FALSE(rig.ok()) << n;
    EXPECT_EQ(rig.error().message().rfind(dir_.file("w.bin") + ": ", 0), 0U) << rig.error().message();
  }
}

TEST_F(RigTest, AWindscreenThatAnnouncesMoreThanItHoldsTakesNoMemory) {
  // GIVEN a header that speaks of 8192 x 8192 nodes and nothing behind it THEN an error without the half gigabyte
  std::ofstream out(dir_.file("w.bin"), std::ios::binary);
  const std::int32_t sides[2] = {8192, 8192};
  const double step = 1;
  out.write("CYCWIND1", 8).write(reinterpret_cast<const char*>(sides), 8).write(reinterpret_cast<const char*>(&step), 8);
  out.close();
  const auto w = Windscreen::load(dir_.file("w.bin"));
  ASSERT_FALSE(w.ok());
  EXPECT_EQ(w.error().code, ErrorCode::kTruncated);
  EXPECT_EQ(w.error().message(), dir_.file("w.bin") + ": has 24 bytes, expected 536870936 for a grid of 8192 x 8192");
}

TEST_F(RigTest, LooksGoWithTheModelOfTheRig) {
  Text t;
  t.tanker += "looks = \"tanker.looks\"\n";
  EXPECT_EQ(load(t).error().message(), dir_.file("tanker.looks") + ": cannot be opened");
  Look look;
  look.id = 8;
  look.p_k = Point<frame::K>(-2.54, 2.54, 0);
  look.light = "noon";
  look.patch.T_c_k = {Rotation<frame::C, frame::K>(), Point<frame::C>(0, 0, 20)};
  look.patch.step_m = 0.1;
  look.patch.then_px = 4 * Mat2::Identity();
  look.tried = look.matched = 9;
  std::ofstream(dir_.file("tanker.looks")) << Looks{{look}}.text();
  const auto rig = load(t);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  ASSERT_EQ(rig->looks.items.size(), 1U);
  EXPECT_EQ(rig->looks.items[0].feature, 1U);
  EXPECT_EQ(rig->files[1].as_written, "tanker.looks") << "a sortie keeps a copy";
  // WHEN another model is named, the rig's looks are not its own
  std::ofstream(dir_.file("other.csv")) << "id,x,y,z\n7,290,0,95\n8,291,100,95\n";
  const auto other = Rig::load(dir_.file("rig.toml"), dir_.file("other.csv"));
  ASSERT_TRUE(other.ok()) << other.error().message();
  EXPECT_TRUE(other->looks.items.empty());
  const auto wrong = Rig::load(dir_.file("rig.toml"), dir_.file("other.csv"), dir_.file("tanker.looks"));
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().message(), dir_.file("tanker.looks") + ":3: x is \"-2.54\", expected the place of feature 8 in the model");
}

}  // namespace
}  // namespace cyclops
