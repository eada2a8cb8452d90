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

TEST(TankerModel, NeedsAHeaderAndAFeature) {
  EXPECT_EQ(parse("").error().message(), "t.csv: holds no feature");
  EXPECT_EQ(parse("id,x,y\n").error().message(), "t.csv:1: header has no column \"z\", expected id, x, y, z");
}

}  // namespace
}  // namespace cyclops
