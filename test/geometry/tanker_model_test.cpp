#include "geometry/tanker_model.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

Result<TankerModel> parse(const std::string& text) { return TankerModel::parse(text, "t.csv", 0.0254, {190, 0, 95}); }

std::string error_of(const std::string& line) {
  const auto m = parse("id,x,y,z,name,normals,sigma,enabled\n" + line + "\n");
  return m.ok() ? "no error" : m.error().message();
}

TEST(TankerModel, ReadsQuotedNamesNormalsSigmaAndComments) {
  const auto m = parse("# surveyed\nid, x ,y,z,name,normals,sigma,enabled,source\r\n\n7,290,0,95,\"boom, \"\"root\"\"\",0 0 2; 1 0 0,0.1,0,hearsay\r\n");
  ASSERT_TRUE(m.ok()) << m.error().message();
  ASSERT_EQ(m->features().size(), 1U);
  const Feature& f = m->features()[0];
  EXPECT_EQ(f.name, "boom, \"root\"");
  ASSERT_EQ(f.normals_m.size(), 2U);
  EXPECT_EQ(f.normals_m[0], Vec3(0, 0, 1)) << "made a unit vector";
  EXPECT_NEAR(f.sigma_m, 0.00254, 1e-15);
  EXPECT_FALSE(f.enabled);
}

TEST(TankerModel, NamesLineAndCellOfWhatIsWrong) {
  EXPECT_EQ(error_of("1,2,three,4"), "t.csv:2: y is \"three\", expected a finite number");
  EXPECT_EQ(error_of("1,inf,3,4"), "t.csv:2: x is \"inf\", expected a finite number");
  EXPECT_EQ(error_of("1,1e300,3,4"), "t.csv:2: x is \"1e300\", expected a place within 10 km");
  EXPECT_EQ(error_of("1.5,2,3,4"), "t.csv:2: id is \"1.5\", expected a whole number");
  EXPECT_EQ(error_of("1,2,3"), "t.csv:2: z is \"\", expected a finite number");
  EXPECT_EQ(error_of("1,2,3,4,n,0 0"), "t.csv:2: normals is \"0 0\", expected \"nx ny nz; nx ny nz\"");
  EXPECT_EQ(error_of("1,2,3,4,n,0 0 0").rfind("t.csv:2: normals is", 0), 0U);
  EXPECT_EQ(error_of("1,2,3,4,n,1e200 1e200 1e200").rfind("t.csv:2: normals is", 0), 0U);
  EXPECT_EQ(error_of("1,2,3,4,n,,-1"), "t.csv:2: sigma is \"-1\", expected a number from 0 to 10 m");
  EXPECT_EQ(error_of("1,2,3,4,n,,,yes"), "t.csv:2: enabled is \"yes\", expected 0 or 1");
  EXPECT_EQ(error_of("1,2,3,4\n1,2,3,5"), "t.csv:3: id 1 stands twice");
}

TEST(TankerModel, ReadsWhereALearntFeatureIsAndWasSeenFrom) {
  const auto m = parse("id,x,y,z,cov,seen_from,seen_range\n1,2,3,4,4 0 0 9 1 16,0 0 -2 60,100 200\n2,2,3,5,,,\n3,2,3,6,,,0 50\n");
  ASSERT_TRUE(m.ok()) << m.error().message();
  const Feature& f = m->features()[0];
  ASSERT_TRUE(f.cov_m2 && f.seen_from);
  EXPECT_NEAR((*f.cov_m2)(1, 2), 0.0254 * 0.0254, 1e-12);
  const double m1 = 0.0254;  // of an inch
  EXPECT_TRUE(f.seen_from->holds({0, 0, -150 * m1}));
  EXPECT_TRUE(f.seen_from->holds({150 * m1 * std::sin(1.0), 0, -150 * m1 * std::cos(1.0)})) << "57 of 60 degrees";
  EXPECT_FALSE(f.seen_from->holds({150 * m1 * std::sin(1.1), 0, -150 * m1 * std::cos(1.1)}));
  EXPECT_FALSE(f.seen_from->holds({0, 0, -90 * m1})) << "too near";
  EXPECT_FALSE(f.seen_from->holds({0, 0, -210 * m1})) << "too far";
  EXPECT_FALSE(m->features()[1].cov_m2 || m->features()[1].seen_from);
  EXPECT_TRUE(m->features()[2].seen_from->holds({1, 0, 0})) << "a range alone allows any direction";
}

TEST(TankerModel, TurnsACovarianceIntoCameraAxes) {
  const auto m = parse("id,x,y,z,cov\n1,2,3,4,4 0 0 9 0 16\n2,2,3,5,\n");
  Mat3 R;  // camera axes: x is tanker right, y is tanker down, z is tanker forward
  R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  const Mat3 C = TankerModel::covariance_in_camera(m->features()[0], R) / (0.0254 * 0.0254);
  EXPECT_LT((C - Mat3(Vec3(9, 16, 4).asDiagonal())).norm(), 1e-12);
  EXPECT_LT((TankerModel::covariance_in_camera(m->features()[1], R) - kSurveySigma_m * kSurveySigma_m * Mat3::Identity()).norm(), 1e-18);
}

TEST(TankerModel, RefusesACovarianceOrASectorThatIsNone) {
  const auto error = [](const std::string& cells) { return parse("id,x,y,z,cov,seen_from,seen_range\n1,2,3,4," + cells + "\n").error().message(); };
  EXPECT_EQ(error("1 0 0 1 0,,"), "t.csv:2: cov is \"1 0 0 1 0\", expected \"xx xy xz yy yz zz\" of a covariance");
  EXPECT_EQ(error("1 2 0 1 0 1,,").rfind("t.csv:2: cov is", 0), 0U) << "not positive";
  EXPECT_EQ(error("1 0 0 1 0 1e9,,").rfind("t.csv:2: cov is", 0), 0U) << "larger than 10 m";
  EXPECT_EQ(error(",0 0 0 30,"), "t.csv:2: seen_from is \"0 0 0 30\", expected \"x y z deg\" with deg above 0, at most 180");
  EXPECT_EQ(error(",0 0 1 181,").rfind("t.csv:2: seen_from is", 0), 0U);
  EXPECT_EQ(error(",,5 5"), "t.csv:2: seen_range is \"5 5\", expected \"least most\"");
}

TEST(TankerModel, NeedsAHeaderAndAFeature) {
  EXPECT_EQ(parse("").error().message(), "t.csv: holds no feature");
  EXPECT_EQ(parse("id,x,y\n").error().message(), "t.csv:1: header has no column \"z\", expected id, x, y, z");
}

}  // namespace
}  // namespace cyclops
