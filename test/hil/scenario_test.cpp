// What a scenario file may say, and what is refused with file and line, or with time and place.
#include "hil/scenario.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "hil/flight_scene.hpp"
#include "test/support.hpp"

namespace cyclops::hil {
namespace {

std::string refusal(const std::string& text) {
  const auto s = Scenario::parse(text, "config/scenarios/x.toml");
  return s.ok() ? "" : s.error().message();
}

std::string impossible(const std::string& text) {
  const auto s = Scenario::parse("base = \"base.toml\"\nname = \"x\"\nframes = 60\n" + text, "config/scenarios/x.toml");
  if (!s.ok()) return s.error().message();
  const auto scene = FlightScene::load(*s);
  return scene.ok() ? "" : scene.error().message();
}

TEST(Scenario, EveryOneOfTheFolderCanBeFlown) {
  int n = 0;
  for (const auto& entry : std::filesystem::directory_iterator("config/scenarios")) {
    auto s = Scenario::load(entry.path().string());
    ASSERT_TRUE(s.ok()) << s.error().message();
    if (entry.path().stem() == "base") continue;
    EXPECT_EQ(s->name, entry.path().stem().string());
    EXPECT_FALSE(s->about.empty()) << s->name;
    s->frames = std::min(s->frames, 30);
    const auto scene = FlightScene::load(*s);
    EXPECT_TRUE(scene.ok()) << scene.error().message();
    ++n;
  }
  EXPECT_GE(n, 15);
}

TEST(Scenario, TakesFromItsBaseWhatItDoesNotSay) {
  const Scenario base = Scenario::load("config/scenarios/s1.toml").value(), s = Scenario::load("config/scenarios/s1-50.toml").value();
  EXPECT_EQ(s.name, "s1-50");
  EXPECT_EQ(s.frames, base.frames);
  EXPECT_EQ(s.range_ft, 100);
  ASSERT_EQ(s.legs.size(), 1U);
  EXPECT_EQ(s.legs[0].closing_ftps, 1.07);
  EXPECT_EQ(s.wing_rocks.size(), base.wing_rocks.size());
  EXPECT_EQ(s.navigation.error_px, base.navigation.error_px);
}

TEST(Scenario, KeepsTheMeshOfItsBaseWhenItSaysOtherThingsAboutTheTanker) {
  const test::TempDir dir;
  std::ofstream(dir.file("own.toml")) << "base = \"" << std::filesystem::absolute("config/scenarios/heavy.toml").string() << "\"\n[tanker]\nmesh_feature_tolerance_in = 0.5\n";
  const Scenario s = Scenario::load(dir.file("own.toml")).value(), heavy = Scenario::load("config/scenarios/heavy.toml").value();
  EXPECT_TRUE(std::filesystem::equivalent(s.mesh.mesh, "config/heavy/tanker.obj")) << s.mesh.mesh;
  EXPECT_NEAR(s.mesh.feature_tolerance_m, 0.0127, 1e-12);
  EXPECT_EQ(s.mesh.file.metres_per_unit, heavy.mesh.file.metres_per_unit);
}

TEST(Scenario, RefusalsNameFileLineAndWhatWasExpected) {
  EXPECT_NE(refusal("base = \"base.toml\"\n[navigation]\nposition_sigma = 1.0\n").find("x.toml:3: navigation.position_sigma: unknown key"), std::string::npos);
  EXPECT_NE(refusal("base = \"base.toml\"\n[[leg]]\nfor_s = 3.0\nrange_ft = 50.0\nup_ftps = 1.0\n").find("rates or a place"), std::string::npos);
  EXPECT_NE(refusal("base = \"base.toml\"\n[[leg]]\nclosing_ftps = 1.0\n").find("one of for_s and for_frames"), std::string::npos);
  EXPECT_NE(refusal("base = \"base.toml\"\n[navigation]\nerror_px = [1.0, 2.0]\n").find("as many numbers"), std::string::npos);
  EXPECT_NE(refusal("base = \"none.toml\"\n").find("x.toml:1: base"), std::string::npos);
  EXPECT_NE(refusal("name = \"x\"\n").find("tanker.model"), std::string::npos);
}

TEST(Scenario, ABaseOfItselfIsRefused) {
  const test::TempDir dir;
  std::ofstream(dir.file("loop.toml")) << "base = \"loop.toml\"\n";
  const auto s = Scenario::load(dir.file("loop.toml"));
  ASSERT_FALSE(s.ok());
  EXPECT_NE(s.error().message().find("stand on each other"), std::string::npos) << s.error().message();
}

TEST(Scenario, AReceiverThatFliesIntoTheTankerIsRefusedWithTimeAndPlace) {
  // 100 ft/s from 75 ft: within a second the nose is in the tail
  const std::string why = impossible("[[leg]]\nfor_s = 2.0\nclosing_ftps = 60.0\n");
  EXPECT_NE(why.find("s (frame "), std::string::npos) << why;
  EXPECT_NE(why.find("the tanker, at x "), std::string::npos) << why;
}

TEST(Scenario, ALensInsideTheTankerIsRefused) {
  const std::string why = impossible("[mount]\nlens_in_receiver_m = [0.0, 0.0, 0.0]\nnose_from_lens_m = [-30.0, 0.0, -5.0]\n[start]\nrange_ft = 40.0\nelevation_deg = 0.0\n");
  EXPECT_NE(why.find("the tanker"), std::string::npos) << why;
}

TEST(Scenario, ACameraThatNeverSeesTheTankerIsRefused) {
  EXPECT_NE(impossible("[mount]\npan_deg = 120.0\n").find("never sees the tanker"), std::string::npos);
}

}  // namespace
}  // namespace cyclops::hil
