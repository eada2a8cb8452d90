#include "service/profile.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "test/support.hpp"

namespace cyclops {
namespace {

/// The tests run from the root of the tree, where config/ is.
std::string shipped(const std::string& name) { return "config/" + name; }

Result<Profile> load_text(const test::TempDir& dir, const std::string& text) {
  std::ofstream(dir.file("p.toml")) << text;
  return Profile::load(dir.file("p.toml"));
}

TEST(Profile, TheDefaultFileSaysWhatIsBuiltIn) {
  const auto file = Profile::load(shipped("default.toml"));
  ASSERT_TRUE(file.ok()) << file.error().message();
  const Profile built_in;
  EXPECT_EQ(file->name, "default.toml");
  EXPECT_EQ(file->nav, built_in.nav);
  EXPECT_EQ(file->estimate, built_in.estimate);
  EXPECT_EQ(file->segment, built_in.segment);
  EXPECT_EQ(file->detect, built_in.detect);
  EXPECT_EQ(file->align, built_in.align);
  EXPECT_EQ(file->edge, built_in.edge);
  EXPECT_EQ(file->patch, built_in.patch);
  EXPECT_EQ(file->associate, built_in.associate);
  EXPECT_EQ(file->track, built_in.track);
  EXPECT_EQ(file->publish, built_in.publish);
}

TEST(Profile, AKeyLeftOutIsTheBuiltInProfiles) {
  // GIVEN one key of one table THEN that key changes and nothing else
  test::TempDir dir;
  const auto p = load_text(dir, "[detect]\nnms_radius_px = 4\n");
  ASSERT_TRUE(p.ok()) << p.error().message();
  Profile expected;
  expected.detect.nms_radius_px = 4;
  EXPECT_EQ(p->detect, expected.detect);
  EXPECT_EQ(p->segment, expected.segment);
  EXPECT_EQ(p->associate, expected.associate);
  EXPECT_EQ(p->publish, expected.publish);
}

TEST(Profile, TheModeOfTheThesisBringsItsOwnDefaults) {
  test::TempDir dir;
  const auto p = load_text(dir, "[detect]\nmode = \"thesis\"\n");
  ASSERT_TRUE(p.ok()) << p.error().message();
  EXPECT_EQ(p->detect, DetectConfig::thesis());
}

TEST(Profile, TheOneOf2007IsTheThesis) {
  const auto p = Profile::load(shipped("thesis-2007.toml"));
  ASSERT_TRUE(p.ok()) << p.error().message();
  EXPECT_EQ(p->nav.update_every_n_frames, 30);
  EXPECT_EQ(p->segment.buffer_px, 30);
  EXPECT_EQ(p->detect.mode, DetectMode::kThesis);
  EXPECT_FALSE(p->align.enabled);
  EXPECT_EQ(p->associate.gate, Gate::kFixed);
  EXPECT_EQ(p->associate.gate_px, 13);
  EXPECT_EQ(p->track.filter, Filter::kZoh);
  EXPECT_EQ(p->publish.max_nis, 0);
}

TEST(Profile, EveryFileInConfigLoads) {
  for (const auto& entry : std::filesystem::directory_iterator("config"))
    if (entry.path().extension() == ".toml" && entry.path().filename() != "alarms.toml") {  // its own: test/monitor
      const auto p = Profile::load(entry.path().string());
      EXPECT_TRUE(p.ok()) << p.error().message();
    }
}

TEST(Profile, NamesFileLineAndKeyOfWhatIsWrong) {
  test::TempDir dir;
  const struct { const char* text; const char* at; } wrong[] = {
      {"[nav]\nmax_wait_ms = 50.0\nmax_weight_ms = 50.0\n", ":3: nav.max_weight_ms: unknown key"},
      {"[navigation]\n", ":1: navigation: unknown key"},
      {"[track]\n\nfilter = \"particle\"\n", ":3: track.filter: is \"particle\", expected"},
      {"[detect]\ngaussian_size = 8\n", ":2: detect.gaussian_size"},
      {"[publish]\nmax_nis = \"much\"\n", ":2: publish.max_nis: is 'much', expected a number"},
      {"[align]\nenabled = 1\n", ":2: align.enabled: is 1, expected true or false"},
      {"[associate]\ngate_px = nan\n", ":2: associate.gate_px"},
      {"[segment]\nbuffer_px = 30\nbuffer_px = 31\n", ":3"},
      {"nav = 3\n", ":1: nav: is 3, expected a table"},
  };
  for (const auto& w : wrong) {
    const auto p = load_text(dir, w.text);
    ASSERT_FALSE(p.ok()) << w.text;
    EXPECT_EQ(p.error().message().rfind(dir.file("p.toml") + w.at, 0), 0U) << p.error().message();
  }
}

TEST(Profile, RefusesABufferThatLosesCornersOfItsOwnGate) {
  // GIVEN a gate of 13 px, a border of 5 and a radius of 3 WHEN the buffer is 21 px THEN it is 1 px too small
  test::TempDir dir;
  const std::string gate = "[associate]\ngate = \"fixed\"\ngate_px = 13.0\n";
  const auto small = load_text(dir, gate + "[segment]\nbuffer_px = 21\n");
  ASSERT_FALSE(small.ok());
  EXPECT_EQ(small.error().message(), "segment.buffer_px: is 21, expected at least gate + border + NMS radius + 1 = 22");
  EXPECT_TRUE(load_text(dir, gate + "[segment]\nbuffer_px = 22\n").ok());
}

TEST(Profile, SaysThatAFileIsNotThere) {
  const auto p = Profile::load("/nowhere/p.toml");
  ASSERT_FALSE(p.ok());
  EXPECT_EQ(p.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(p.error().message(), "/nowhere/p.toml: cannot be opened");
}

}  // namespace
}  // namespace cyclops
