#include "align/anchor.hpp"

#include <gtest/gtest.h>

namespace cyclops::align {
namespace {

CameraPose pose(const Vec3& turn, const Vec3& place) { return {Rotation<frame::C, frame::K>(so3_exp(turn)), Point<frame::C>(place)}; }

Prior prior(const CameraPose& T, const Mat6& P) {
  Prior p;
  p.T = T;
  p.P = P;
  p.valid = true;
  return p;
}

/// Navigation 0.4 m off to the right at the update; since then it says 1 m closer, 0.2 m down and a turn.
struct Update {
  CameraPose nav = pose({0, 0, 0}, {0.4, -2, 30}), now = pose({0.01, 0.02, 0}, {0.4, -1.8, 29});
  Mat6 nav_P = 0.04 * Mat6::Identity();
  Alignment alignment{};
  RelativeState carried{};
  Update() {
    alignment.consensus = true;
    alignment.T_c_k = pose({0, 0, 0}, {0, -2, 30});
    alignment.covariance = 1e-4 * Mat6::Identity();
    carried.covariance = nav_P;
    carried.covariance(3, 3) += 0.09;  // along the receiver's nose, the camera's axis
  }
};

/// Camera right down out from receiver forward right down.
Mat3 camera_from_receiver() {
  Mat3 R;
  R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  return R;
}

TEST(Anchor, NavigationsLastingErrorStaysOutAndItsMotionIsTaken) {
  const Update u;
  Anchor anchor;
  anchor.set(u.nav, u.nav_P, u.alignment);
  Prior p = prior(u.now, u.carried.covariance);
  anchor.hold(u.carried, camera_from_receiver(), p);
  EXPECT_TRUE(p.T.translation().xyz.isApprox(Vec3(0, -1.8, 29), 1e-12));
  EXPECT_LT(p.T.rotation().quaternion().angularDistance(u.now.rotation().quaternion()), 1e-12);
}

TEST(Anchor, ItsCovarianceIsThatOfTheAlignedPoseAndWhatNavigationsHasGrownBy) {
  const Update u;
  Anchor anchor;
  anchor.set(u.nav, u.nav_P, u.alignment);
  Prior p = prior(u.now, u.carried.covariance);
  anchor.hold(u.carried, camera_from_receiver(), p);
  Mat6 want = u.alignment.covariance;
  want(5, 5) += 0.09;
  EXPECT_TRUE(p.P.isApprox(want, 1e-12)) << p.P;
}

TEST(Anchor, WhereFeaturesDidNotAgreeNavigationIsCarriedItself) {
  Update u;
  u.alignment.consensus = false;
  Anchor anchor;
  anchor.set(u.nav, u.nav_P, u.alignment);
  Prior p = prior(u.now, u.carried.covariance);
  anchor.hold(u.carried, camera_from_receiver(), p);
  EXPECT_TRUE(p.T.translation().xyz.isApprox(u.now.translation().xyz));
  EXPECT_TRUE(p.P.isApprox(u.carried.covariance));
}

}  // namespace
}  // namespace cyclops::align
