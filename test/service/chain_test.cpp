// What only the whole chain does: one stage's word carried to another.
#include "service/chain.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "test/scene.hpp"

namespace cyclops {
namespace {

/// Features stand alone and there is no picture: tracks go where navigation's rates say.
std::unique_ptr<FrameOutput> after_half_a_second(Filter filter, const Vec3& velocity_r, const Vec3& rate_r) {
  const auto rig = std::make_unique<Rig>();
  rig->tanker = test::example_model();
  rig->mount_angles = {0, 16 * test::kDeg, 0};
  rig->lens = Point<frame::R>(2.40, -0.15, -0.60);
  Profile profile;
  profile.align.enabled = profile.edge.enabled = profile.patch.enabled = false;
  profile.track.filter = filter;
  Chain chain(*rig, profile);
  auto out = std::make_unique<FrameOutput>();
  for (int n = 0; n <= 15; ++n) {
    AlignedFrame frame;
    frame.frame.seq = static_cast<std::uint64_t>(n + 1);
    frame.frame.t_mid = Time{1000000000 + n * 33333333LL};
    if (n == 0) {
      frame.nav.state = test::example_state();
      frame.nav.state.t = frame.frame.t_mid;
      frame.nav.state.velocity_r = velocity_r;
      frame.nav.state.rate_r = rate_r;
    }
    chain.step(frame, {}, nullptr, *out);
  }
  return out;
}

TEST(ChainTest, TracksMoveWithNavigationsRatesBetweenItsUpdates) {
  const Vec3 velocity(-0.6, 0.8, 0.2), rate(0.02, -0.01, 0.03);
  const auto out = after_half_a_second(Filter::kKalman, velocity, rate), still = after_half_a_second(Filter::kAlphaBeta, velocity, rate);
  RelativeState then = test::example_state();
  const double T = 15 * 0.033333333;
  then.T_r_k = {Rotation<frame::R, frame::K>(so3_exp(rate * T) * then.T_r_k.rotation().quaternion()),
                Point<frame::R>(then.T_r_k.translation().xyz + velocity * T)};
  const auto want = std::make_unique<PredictionSet>();
  predict(then, test::example_model(), Camera{}, test::example_mount(), {}, *want);
  ASSERT_EQ(out->tracks.size(), want->items.size());
  int moved = 0;
  for (std::size_t i = 0; i < out->tracks.size(); ++i) {
    EXPECT_LT((out->tracks[i].uv_px - want->items[i].uv_px).norm(), 0.8) << i << ": a first velocity of 0 +- 30 px/s still counts a little";
    moved += (still->tracks[i].uv_px - want->items[i].uv_px).norm() > 10;
  }
  EXPECT_GT(moved, 3) << "that they move at all";
}

}  // namespace
}  // namespace cyclops
