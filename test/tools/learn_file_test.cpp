// What is written reads back the same, and a learnt model does not disturb the surveyed one.
#include "tools/learn_file.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "test/tools/learn_scene.hpp"

namespace cyclops {
namespace {

using test::LearnScene;
namespace learn = tools::learn;

constexpr double kInch = 0.0254;
const Vec3 kIns{190, 0, 95};

struct Model {
  learn::Learnt learnt;
  Model() {
    LearnScene scene(1);
    scene.fly(3);
    learnt.views = std::move(scene.views);
    learnt.views.metres_per_unit = kInch;
    learnt.views.tanker = TankerModel::parse("id,name,x,y,z,kind,normals,sigma\n7,\"tip, \"\"right\"\"\",300,100,120,corner,0 0 -1,0.07\n1012,tail,539,0,131,corner,,0.1\n", "t", kInch, kIns).value();
    add({1, 2, 0.5}, -1);
    add(Vec3(learnt.views.tanker.in_body(learnt.views.tanker.features()[0]).xyz + Vec3(0.001, 0, 0)), 0);
  }
  void add(const Vec3& p_k, int survey) {
    learn::ChosenPoint c;
    c.point.p_k = Point<frame::K>(p_k);
    c.point.cov_m2 << 4e-6, 1e-6, 0, 1e-6, 9e-6, -2e-6, 0, -2e-6, 25e-6;
    c.point.sights = {{0, 0}, {1, 0}, {2, 0}};
    c.point.survey = survey;
    c.seen_from = {Vec3(1, 2, -2) / 3, std::cos(0.4), 8, 40};
    c.strength = {{0, 10, 12.5, 20, 19, 0.21}};
    learnt.points.push_back(c);
  }
  [[nodiscard]] TankerModel read(learn::Mix mix) const { return TankerModel::parse(learn::model_csv(learnt, mix, 6), "learnt.csv", kInch, kIns).value(); }
};

TEST(LearnFile, WhatIsWrittenReadsBackTheSame) {
  const Model m;
  const TankerModel read = m.read(learn::Mix::kReplace);
  ASSERT_EQ(read.features().size(), 4U);
  const Feature& f = read.features()[2];
  const learn::ChosenPoint& c = m.learnt.points[0];
  EXPECT_EQ(f.id, 2000) << "the next thousand after 1012";
  EXPECT_EQ(f.kind, "learnt");
  EXPECT_LT((read.in_body(f) - c.point.p_k).norm(), 1e-12);
  ASSERT_TRUE(f.cov_m2 && f.seen_from);
  const Mat3 D = Vec3(-1, 1, -1).asDiagonal();
  EXPECT_LT((*f.cov_m2 - D * c.point.cov_m2 * D).norm(), 1e-18);
  EXPECT_LT((f.seen_from->axis_m - c.seen_from.axis_m).norm(), 1e-12);
  EXPECT_NEAR(f.seen_from->least_cosine, c.seen_from.least_cosine, 1e-12);
  EXPECT_NEAR(f.seen_from->most_m, 40, 1e-9);
  EXPECT_NEAR(f.sigma_m, std::sqrt(c.point.cov_m2.trace() / 3), 1e-12);
}

TEST(LearnFile, SurveyedFeaturesStayWithTheirIdsSwitchedOff) {
  const Model m;
  const TankerModel read = m.read(learn::Mix::kReplace);
  EXPECT_EQ(read.features()[0].id, 7);
  EXPECT_EQ(read.features()[0].name, "tip, \"right\"");
  EXPECT_FALSE(read.features()[0].enabled);
  EXPECT_EQ(read.features()[0].p_m.xyz, m.learnt.views.tanker.features()[0].p_m.xyz);
  EXPECT_EQ(read.features()[0].normals_m.size(), 1U);
  EXPECT_TRUE(read.features()[2].enabled);
  EXPECT_EQ(read.features()[3].name, "learnt 2001 near 7");
}

TEST(LearnFile, AddedPointsKeepTheirDistanceFromTheSurveyedOnes) {
  const TankerModel read = Model().read(learn::Mix::kAdd);
  ASSERT_EQ(read.features().size(), 3U) << "the point at feature 7 is left out";
  EXPECT_TRUE(read.features()[0].enabled);
  EXPECT_EQ(read.features()[2].id, 2000);
}

TEST(LearnFile, StrengthIsListedByFlightAndRange) {
  const auto j = nlohmann::json::parse(learn::strength_json(Model().learnt));
  ASSERT_EQ(j["points"].size(), 2U);
  const auto& bin = j["points"][1]["by_range"][0];
  EXPECT_EQ(bin["flight"], "made-up");
  EXPECT_EQ(bin["found"], 19);
  EXPECT_EQ(j["points"][1]["survey"], 7);
}

TEST(LearnFile, AFileThatCannotBeWrittenIsNamed) {
  EXPECT_EQ(learn::write_text("/nowhere/model.csv", "x").error().message(), "/nowhere/model.csv: cannot be written");
  const test::TempDir dir;
  ASSERT_TRUE(learn::write_text(dir.file("m.csv"), "abc\n").ok());
  EXPECT_EQ(read_file(dir.file("m.csv")).value(), "abc\n");
  EXPECT_FALSE(std::filesystem::exists(dir.file("m.csv.part")));
}

}  // namespace
}  // namespace cyclops
