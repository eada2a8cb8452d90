#include "geometry/frames.hpp"

#include <gtest/gtest.h>

#include <type_traits>

namespace cyclops {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr double kFoot = 0.3048;

template <class A, class B>
concept Subtractable = requires(A a, B b) { a - b; };
template <class A, class B>
concept Multipliable = requires(A a, B b) { a * b; };

// Spec errata E5 and 3.5: what went wrong in the thesis must not compile.
static_assert(!Subtractable<HeadingPitchBank, HeadingPitchBank>);
static_assert(!std::is_convertible_v<FlightPath, HeadingPitchBank>);
static_assert(!Multipliable<Rotation<frame::N, frame::R>, Rotation<frame::N, frame::K>>);
static_assert(Multipliable<Rotation<frame::R, frame::N>, Rotation<frame::N, frame::K>>);

// Spec 1.7: relative attitude (2, -1, 3) deg.
TEST(Frames, RelativeAttitudeIsYawPitchRollInBodyAxes) {
  const auto R = Mat3(rotation_z(2 * kDeg) * rotation_y(-1 * kDeg) * rotation_x(3 * kDeg));
  Mat3 want;
  want << 0.999238615, -0.035764500, -0.015591373, 0.034894181, 0.997989320, -0.052912320, 0.017452406, 0.052327985, 0.998477439;
  EXPECT_LT((R - want).cwiseAbs().maxCoeff(), 1e-9);
}

// Spec E5: composition in a 15 deg bank, receiver (0, 4, 15), tanker (5, 2, 15) deg.
TEST(Frames, ComposesRelativeAttitudeInsteadOfSubtractingEulerAngles) {
  const auto R_n_r = attitude<frame::R>({0, 4 * kDeg, 15 * kDeg});
  const auto R_n_k = attitude<frame::K>({5 * kDeg, 2 * kDeg, 15 * kDeg});
  const auto e = heading_pitch_bank((R_n_r.inverse() * R_n_k).matrix());
  EXPECT_NEAR(e.heading / kDeg, 5.342, 1e-3);
  EXPECT_NEAR(e.pitch / kDeg, -0.625, 1e-3);
  EXPECT_NEAR(e.bank / kDeg, -0.291, 1e-3);
}

// Spec 3.5: pitch 5, heading = track + 6.5 deg.
TEST(Frames, TurnsAFlightPathVectorIntoReceiverBodyAxes) {
  const Vec3 p_path = Vec3(72.444437, 0, -19.411428) * kFoot;
  const auto R_n_r = attitude<frame::R>({(30 + 6.5) * kDeg, 5 * kDeg, 0});
  const auto p = receiver_body_from_path(p_path, {30 * kDeg, 0}, R_n_r);
  EXPECT_NEAR(p.xyz.x() / kFoot, 73.396670, 1e-5);
  EXPECT_NEAR(p.xyz.y() / kFoot, -8.200943, 1e-5);
  EXPECT_NEAR(p.xyz.z() / kFoot, -13.064200, 1e-5);
}

TEST(Frames, ExponentialAndLogarithmUndoEachOther) {
  for (const Vec3& w : {Vec3(0, 0, 0), Vec3(1e-10, 0, 0), Vec3(0.3, -0.2, 1.1), Vec3(0, 3.1, 0)})
    EXPECT_LT((so3_log(so3_exp(w)) - w).norm(), 1e-12);
}

TEST(Frames, PoseInverseTakesAPointBack) {
  const Pose<frame::R, frame::K> T(Rotation<frame::R, frame::K>(so3_exp({0.2, -0.4, 0.7})), Point<frame::R>(1, 2, 3));
  const Point<frame::K> p(4, 5, 6);
  EXPECT_LT((T.inverse() * (T * p) - p).norm(), 1e-12);
}

}  // namespace
}  // namespace cyclops
