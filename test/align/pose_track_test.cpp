#include "align/pose_track.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace cyclops::align {
namespace {

constexpr std::int64_t kFrame_ns = 33'000'000;

class PoseTrackTest : public ::testing::Test {
 protected:
  static Time at(int frame) { return Time{1'000'000'000 + frame * kFrame_ns}; }
  static Prior nav_at(const CameraPose& pose) {
    Prior p;
    p.T = pose;
    p.P = 1e-4 * Mat6::Identity();
    p.valid = true;
    return p;
  }
  double apart_px(const CameraPose& a, const CameraPose& b) const {
    double worst = 0;
    for (const auto& p : body) worst = std::max(worst, (*camera.project(a * p) - *camera.project(b * p)).norm());
    return worst;
  }

  AlignConfig config{};
  Camera camera{};
  std::vector<Point<frame::K>> body{{0, 0, 0}, {1, 4, 0.5}, {-2, -4, 1}, {3, 1, 2}, {-1, 2.5, -1}};
  CameraPose before{Rotation<frame::C, frame::K>(Eigen::Quaterniond::Identity()), Point<frame::C>(0.5, -1, 30)};
  CameraPose after = moved(before, (Vec6() << 0, 0, 0.01, 0.1, 0, 0.5).finished());
};

TEST_F(PoseTrackTest, AStepOfWhatNavigationKnowsIsNoMotion) {
  // GIVEN a tanker that stands still; navigation comes, and the pose steps to where it says
  PoseTrack track(config, camera, body);
  track.predict(at(0), nav_at(before));
  track.learn(before, true);
  track.end_frame(nav_at(before));
  for (int frame = 1; frame < 5; ++frame) {
    track.predict(at(frame), {});
    track.learn(before, false);
    track.end_frame({});
  }
  track.predict(at(5), nav_at(after));
  track.learn(after, true);
  track.end_frame(nav_at(after));
  // THEN the next frame is expected there, and not further on
  ASSERT_GT(apart_px(before, after), 4);
  track.predict(at(6), {});
  ASSERT_TRUE(track.prior().valid);
  EXPECT_LT(apart_px(track.prior().T, after), 0.1);
}

TEST_F(PoseTrackTest, AStepWithoutNavigationIsMotion) {
  PoseTrack track(config, camera, body);
  track.predict(at(0), nav_at(before));
  track.learn(before, false);
  track.end_frame({});
  track.predict(at(1), {});
  track.learn(after, false);
  track.end_frame({});
  track.predict(at(2), {});
  EXPECT_GT(apart_px(track.prior().T, after), 2);
  EXPECT_GT(apart_px(track.prior().T, before), apart_px(after, before));
}

TEST_F(PoseTrackTest, ManyWordsOfNavigationInASecondWeighAsOne) {
  const CameraPose beside = moved(before, (Vec6() << 0, 0, 0, 0.02, 0, 0).finished());
  const auto pull = [&](double memory_s) {  // how far navigation at every frame pulls the track towards itself, px
    config.nav_memory_s = memory_s;
    PoseTrack track(config, camera, body);
    for (int frame = 0; frame < 2; ++frame) {
      track.predict(at(frame), nav_at(before));
      track.learn(before, true);
    }
    track.predict(at(2), nav_at(beside));
    return apart_px(track.prior().T, before);
  };
  EXPECT_GT(pull(0), 0.1);
  EXPECT_LT(pull(1), 0.7 * pull(0));
}

TEST_F(PoseTrackTest, SaysThatNavigationContradictsIt) {
  PoseTrack track(config, camera, body);
  track.predict(at(0), nav_at(before));
  track.learn(before, true);
  track.end_frame(nav_at(before));
  track.predict(at(1), nav_at(moved(before, (Vec6() << 0, 0, 0, 0.02, 0, 0).finished())));
  EXPECT_FALSE(track.contradicted());
  track.predict(at(2), nav_at(moved(before, (Vec6() << 0, 0, 0, 3, 0, 0).finished())));
  EXPECT_TRUE(track.contradicted());
}

/// Frames of a tanker whose place is `way(frame)` aside; each learnt. The prior of the next frame stands at the end.
template <class Way>
void fly(PoseTrack& track, const CameraPose& from, int frames, Way way, int every, const std::function<Prior(const CameraPose&)>& nav, const std::function<Time(int)>& at) {
  for (int frame = 0; frame < frames; ++frame) {
    const CameraPose pose = moved(from, (Vec6() << 0, 0, 0, way(frame), 0, 0).finished());
    const bool with = frame % every == 0;
    track.predict(at(frame), with ? nav(pose) : Prior{}, {});
    track.learn(pose, with);
    track.end_frame({});
  }
  track.predict(at(frames), {});
}

TEST_F(PoseTrackTest, FollowsAFastMotionThatTurns) {
  // GIVEN 20 px a frame at most, there and back in 24 frames, which no constant velocity describes
  const auto way = [](int frame) { return 1.35 * std::sin(2 * 3.14159265 / 24 * frame); };
  PoseTrack track(config, camera, body);
  fly(track, before, 48, way, 1000, nav_at, at);
  const CameraPose there = moved(before, (Vec6() << 0, 0, 0, way(48), 0, 0).finished());
  const CameraPose last = moved(before, (Vec6() << 0, 0, 0, way(47), 0, 0).finished());
  ASSERT_GT(apart_px(last, there), 10);
  EXPECT_LT(apart_px(track.prior().T, there), 2.5);
}

TEST_F(PoseTrackTest, WhereMotionIsFastAnUpdateOfNavigationIsNoReasonToStandStill) {
  // GIVEN 35 px a frame at most, and an update in the frame before the last: navigation comes and goes
  const auto way = [](int frame) { return 2.4 * std::sin(2 * 3.14159265 / 24 * frame); };
  PoseTrack track(config, camera, body);
  fly(track, before, 49, way, 47, nav_at, at);
  EXPECT_LT(apart_px(track.prior().T, moved(before, (Vec6() << 0, 0, 0, way(49), 0, 0).finished())), 4);
}

TEST_F(PoseTrackTest, FollowsWhatThePicturesShowWhereNothingElseIsKnown) {
  PoseTrack track(config, camera, body);
  track.predict(at(0), nav_at(before));
  track.learn(before, true);
  track.end_frame(nav_at(before));
  track.predict(at(1), {});
  EXPECT_GT(track.spread_px(track.prior().T, track.prior().P), 2) << "after one pose nothing is known of the motion";
  track.follow({after, 1e-6 * Mat6::Identity(), true}, {});
  EXPECT_LT(apart_px(track.prior().T, after), 0.1);
  EXPECT_GE(track.spread_px(track.prior().T, track.prior().P), config.track_floor_px) << "pictures are coarse";
}

TEST_F(PoseTrackTest, DoesNotFollowPicturesWhereItIsSureOfTheMotion) {
  PoseTrack track(config, camera, body);
  for (int frame = 0; frame < 20; ++frame) {
    track.predict(at(frame), frame == 0 ? nav_at(before) : Prior{});
    track.learn(before, false);
    track.end_frame({});
  }
  track.predict(at(20), {});
  track.follow({after, 1e-6 * Mat6::Identity(), true}, {});
  EXPECT_LT(apart_px(track.prior().T, before), 0.1);
}

TEST_F(PoseTrackTest, APoseFarFromAContradictedTrackBeginsAnotherOne) {
  // GIVEN a track that moves, and navigation that shows it to be elsewhere
  PoseTrack track(config, camera, body);
  fly(track, before, 10, [](int frame) { return 0.2 * frame; }, 1000, nav_at, at);
  const CameraPose elsewhere = moved(before, (Vec6() << 0, 0, 0, -3, 1, 0).finished());
  track.predict(at(10), nav_at(elsewhere));
  ASSERT_TRUE(track.contradicted());
  track.learn(elsewhere, true);
  track.end_frame({});
  track.predict(at(11), {});
  // THEN nothing of the old motion is carried on
  EXPECT_LT(apart_px(track.prior().T, elsewhere), 0.1);
  EXPECT_GT(track.spread_px(track.prior().T, track.prior().P), 2);
}

}  // namespace
}  // namespace cyclops::align
