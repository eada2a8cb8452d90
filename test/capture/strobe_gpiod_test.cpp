// Without GPIO hardware only the refusals can be seen; what is left to test is listed in docs/time.md.
#include <gtest/gtest.h>

#include "capture/strobe_source.hpp"

namespace cyclops {
namespace {

StrobeConfig gpio(const std::string& chip) {
  StrobeConfig c;
  c.kind = StrobeKind::kGpio;
  c.chip = chip;
  return c;
}

TEST(GpioStrobe, AChipThatDoesNotExistIsNamedInTheError) {
  for (const std::string chip : {"no-such-chip", "/dev/no-such-chip"}) {
    const auto source = make_strobe_source(gpio(chip));
    const auto opened = source->open();
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
    EXPECT_TRUE(opened.error().message().starts_with(chip + ": no GPIO chip of that label, name or path; this machine has")) << opened.error().message();
    EXPECT_FALSE(source->status().connected);
  }
}

TEST(GpioStrobe, WaitingWithoutAnOpenLineIsAnErrorAndDoesNotBlock) {
  const auto source = make_strobe_source(gpio("no-such-chip"));
  EXPECT_FALSE(source->wait(Duration::from_ms(60'000)).ok());
  StrobeEdge edge;
  EXPECT_FALSE(source->read_many({&edge, 1}).ok());
}

}  // namespace
}  // namespace cyclops
