// The file of looks: what is written reads back, and what is wrong is named.
#include "patch/looks.hpp"

#include <gtest/gtest.h>

#include "test/patch/look_scene.hpp"

namespace cyclops {
namespace {

class LooksTest : public ::testing::Test {
 protected:
  LooksTest() { looks.items = {scene.look(4, 0), scene.look(5, 3)}; }
  /// Message after field `i` of the first look became `value`.
  std::string with_field(std::size_t i, const std::string& value) const {
    const std::string text = looks.text();
    std::size_t at = text.find('\n', text.find('\n') + 1) + 1;
    for (std::size_t k = 0; k < i; ++k) at = text.find(',', at) + 1;
    const std::size_t end = text.find_first_of(",\n", at);
    const auto read = Looks::parse(text.substr(0, at) + value + text.substr(end), "l", scene.plate.model);
    return read.ok() ? "no error" : read.error().message();
  }
  std::string message(const std::string& text) const {
    const auto read = Looks::parse(text, "l", scene.plate.model);
    return read.ok() ? "no error" : read.error().message();
  }
  test::LookScene scene;
  Looks looks;
};

TEST_F(LooksTest, WhatIsWrittenReadsBack) {
  const auto read = Looks::parse(looks.text(), "l", scene.plate.model);
  ASSERT_TRUE(read.ok()) << read.error().message();
  ASSERT_EQ(read->items.size(), 2U);
  EXPECT_EQ(read->text(), looks.text());
  const Look &a = looks.items[1], &b = read->items[1];
  EXPECT_EQ(b.id, 6);
  EXPECT_EQ(b.feature, 5U);
  EXPECT_EQ(b.light, "drawn");
  EXPECT_EQ(b.patch.store, a.patch.store);
  EXPECT_EQ(b.patch.inside_px, a.patch.inside_px);
  EXPECT_EQ(b.patch.T_c_k.translation().xyz, a.patch.T_c_k.translation().xyz);
  EXPECT_LT((b.patch.then_px / b.patch.step_m - a.patch.then_px / a.patch.step_m).norm(), 1e-9);
}

TEST_F(LooksTest, AWrongValueIsNamedWithItsPlaceAndWhatWasExpected) {
  EXPECT_EQ(with_field(0, "99"), "l:3: id is \"99\", expected a feature of the model");
  EXPECT_EQ(with_field(0, "5.5"), "l:3: id is \"5.5\", expected a whole number");
  EXPECT_EQ(with_field(2, "1.5"), "l:3: y is \"1.5\", expected the place of feature 5 in the model") << "looks of another tanker";
  EXPECT_EQ(with_field(4, "a b"), "l:3: light is \"a b\", expected 1 to 100 letters, digits, - _ .");
  EXPECT_EQ(with_field(8, "0.99"), "l:3: qz is \"0.99\", expected qw qx qy qz of length 1");
  EXPECT_EQ(with_field(11, "-9"), "l:3: tz is \"-9\", expected a pose with the feature before the camera");
  EXPECT_EQ(with_field(12, "nan"), "l:3: right_u is \"nan\", expected a number from -1e+06 to 1e+06");
  EXPECT_EQ(with_field(16, "7"), "l:3: u is \"7\", expected a number from -6 to 6");
  EXPECT_EQ(with_field(19, "31"), "l:3: matched is \"31\", expected a number from 1 to 30");
  EXPECT_EQ(with_field(20, "0.1x"), "l:3: scatter is \"0.1x\", expected a number from 0 to 10");
  EXPECT_EQ(with_field(22, "1.01"), "l:3: correlation is \"1.01\", expected a number from 0 to 1");
  EXPECT_EQ(with_field(23, "12"), "l:3: pixels is \"12\", expected 2738 hexadecimal digits");
  EXPECT_EQ(with_field(23, "-1" + std::string(2736, '0')).substr(0, 19), "l:3: pixels is \"-10");
  EXPECT_EQ(with_field(23, std::string(2737, '0') + "g").substr(0, 14), "l:3: pixels is");
}

TEST_F(LooksTest, AFileThatIsNoneOrCutShortIsRefused) {
  const std::string text = looks.text();
  EXPECT_EQ(message(""), "l: does not end with a whole line, expected looks as cyclops-learn writes them");
  EXPECT_EQ(message(text.substr(0, text.size() - 1)), "l: does not end with a whole line, expected looks as cyclops-learn writes them");
  EXPECT_EQ(message("id,x\n"), "l:1: is \"id,x\", expected \"cyclops-looks-1\"");
  EXPECT_EQ(message("cyclops-looks-1\nid,x\n").substr(0, 26), "l:2: is \"id,x\", expected \"");
  EXPECT_EQ(message(text + "1,2\n"), "l:5: has 2 fields, expected 24");
  EXPECT_EQ(message(text + "\n"), "l:5: has 1 fields, expected 24");
  const std::string line = text.substr(text.rfind('\n', text.size() - 2) + 1);
  std::string many = text;
  for (std::size_t i = 1; i < Looks::kMostOfFeature; ++i) many += line;
  EXPECT_EQ(message(many), "no error");
  EXPECT_EQ(message(many + line), "l:68: is look 65 of feature 6, expected at most 64");
}

TEST_F(LooksTest, EveryCharacterIsLookedAt) {
  // GIVEN a file with one character in error, anywhere but in the name of the light, which may be any
  const std::string text = looks.text();
  const std::size_t name = text.find("drawn"), second = text.find("drawn", name + 5);
  for (std::size_t i = 0; i < text.size(); i += i < 700 ? 1 : 97) {
    if ((i >= name && i < name + 5) || (i >= second && i < second + 5)) continue;
    std::string other = text;
    other[i] = '!';
    EXPECT_FALSE(Looks::parse(other, "l", scene.plate.model).ok()) << "character " << i;
  }
}

}  // namespace
}  // namespace cyclops
