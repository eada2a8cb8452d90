#include "hil/fault_script.hpp"

#include <gtest/gtest.h>

#include <set>

namespace cyclops::hil {
namespace {

std::string refusal(const std::string& text) {
  const auto script = FaultScript::parse(text, "script.toml");
  return script.ok() ? "accepted" : script.error().message();
}

TEST(FaultScript, ReadsEveryKindByItsNameWithItsUsualAmount) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < kFaultKinds; ++i) {
    const FaultForm& form = form_of(static_cast<FaultKind>(i));
    names.insert(form.name);
    const std::string text = std::string("[[fault]]\nkind = \"") + form.name + "\"\n" + (form.text != nullptr ? std::string(form.text) + " = \"here\"\n" : "");
    const auto script = FaultScript::parse(text, "script.toml");
    ASSERT_TRUE(script.ok()) << script.error().message();
    ASSERT_EQ(script->faults.size(), 1U);
    EXPECT_EQ(static_cast<std::size_t>(script->faults[0].kind), i);
    EXPECT_DOUBLE_EQ(script->faults[0].amount, form.usual);
    EXPECT_EQ(script->faults[0].name, form.name);
  }
  EXPECT_EQ(names.size(), kFaultKinds);
}

TEST(FaultScript, PutsFaultsInOrderOfOnsetAndKeepsWhatEachSays) {
  const auto script = FaultScript::parse(
      "seed = 5\n[[fault]]\nkind = \"tspi_bias\"\nonset_s = 4.5\nduration_s = 2\neast_m = -3.5\naircraft = \"tanker\"\nname = \"wrong place\"\n"
      "[[fault]]\nkind = \"strobe_lost\"\nonset_s = 1.0\nduration_s = 0.5\nshare = 0.25\n",
      "script.toml");
  ASSERT_TRUE(script.ok()) << script.error().message();
  EXPECT_EQ(script->seed, 5);
  ASSERT_EQ(script->faults.size(), 2U);
  EXPECT_EQ(script->faults[0].kind, FaultKind::kStrobeLost);
  EXPECT_DOUBLE_EQ(script->faults[0].share, 0.25);
  EXPECT_DOUBLE_EQ(script->faults[0].end_s(), 1.5);
  EXPECT_EQ(script->faults[1].name, "wrong place");
  EXPECT_DOUBLE_EQ(script->faults[1].amount, -3.5);
  EXPECT_EQ(script->faults[1].choice, 1);
}

TEST(FaultScript, RefusesWhatItDoesNotKnowWithFileAndLine) {
  EXPECT_EQ(refusal("[[fault]]\nkind = \"gremlins\"\n").find("script.toml:2: fault[0].kind: is \"gremlins\", expected one of: packet_loss"), 0U);
  EXPECT_EQ(refusal("[[fault]]\nkind = \"pps_loss\"\nshare = 0.5\n"), "script.toml:3: fault[0].share: unknown key");
  EXPECT_EQ(refusal("[[fault]]\nkind = \"packet_loss\"\nshare = 1.5\n"), "script.toml:3: fault[0].share: is 1.5, expected 0 to 1");
  EXPECT_EQ(refusal("[[fault]]\nkind = \"tspi_nan\"\naircraft = \"drone\"\n"), "script.toml:3: fault[0].aircraft: is \"drone\", expected one of: receiver, tanker, both");
  EXPECT_NE(refusal("[[fault]]\nonset_s = 1.0\n").find("fault[0].kind: required key is missing"), std::string::npos);
  EXPECT_NE(refusal("[[fault]]\nkind = \"disk_full\"\n").find("fault[0].folder: required key is missing"), std::string::npos);
  EXPECT_NE(refusal("[[fault]]\nkind = \"pps_loss\"\nonset_s = -1.0\n").find("script.toml:3: fault[0].onset_s: is -1, expected 0 to"), std::string::npos);
}

}  // namespace
}  // namespace cyclops::hil
