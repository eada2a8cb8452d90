#include "timesync/frame_stamper.hpp"

#include <gtest/gtest.h>

#include "test/timesync/exposure_sim.hpp"

namespace cyclops {
namespace {

using test::ExposureRun;
using test::ExposureSetup;
using test::Random;
using test::Stamped;

TEST(FrameStamper, StampsEveryFrameOfAQuietRunWithItsOwnEdge) {
  ExposureSetup setup;
  setup.edge_jitter = {};
  Random random(1);
  const ExposureRun run = test::simulate(setup, random);
  FrameStamper stamper(test::stamper_config(setup));
  const auto out = test::feed(stamper, test::interleave(run, {}, {}, random));
  ASSERT_EQ(out.size(), 100U);
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_EQ(out[i].token, i);
    EXPECT_EQ(out[i].info.time_source, TimeSource::kStrobe);
    EXPECT_EQ(out[i].info.t_mid.ns, run.truth[i].ns);
  }
}

}  // namespace
}  // namespace cyclops
