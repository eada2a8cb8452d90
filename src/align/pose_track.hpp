#pragma once
/// Inside align: the aligned pose of earlier frames, moved on to this one, and how far such predictions have been off.
///
/// Five ways compete, by their recent errors on the image: standing still, constant velocity, constant acceleration, navigation's own motion,
/// and the motion that the pictures show where they are looked at for it. The covariance has the shape of navigation's, scaled to the error
/// that the winner has shown; the pictures' own covariance is added.
/// Time     service clock. Threads: one at a time. Memory: fixed.
#include <array>
#include <vector>

#include "align/align_config.hpp"
#include "align/pose.hpp"
#include "base/time.hpp"

namespace cyclops::align {

inline constexpr double kContradiction = 22.0;  ///< squared distance of two poses: 99.9 % of chi-square with 6 degrees of freedom

class PoseTrack {
 public:
  /// All three must outlive this. `body`: the features, tanker body axes.
  PoseTrack(const AlignConfig& config, const Camera& camera, const std::vector<Point<frame::K>>& body)
      : config_(config), camera_(camera), body_(body) {}
  /// Once a frame. `nav` is this frame's navigation, or invalid. `motion`: navigation to take its motion from since the frame before;
  /// it may be believed where its place is not.
  void predict(Time now, const Prior& nav, const Prior& motion);
  void predict(Time now, const Prior& nav) { predict(now, nav, nav); }
  [[nodiscard]] const Prior& prior() const { return prior_; }
  /// After predict: where the pictures lead to from the last pose, and how surely. `nav` as there.
  void follow(const Prior& pictures, const Prior& nav);
  /// Navigation of this frame says that the track cannot be where it is.
  [[nodiscard]] bool contradicted() const { return contradicted_; }
  /// The pose that this frame's features agreed on. Where navigation comes or goes from one frame to the next, the step is what it
  /// knows and the picture does not: no motion. `corrected`: neither is the way to this pose, the one before was wrong. Where motions are large
  /// and hard to foretell both are motion.
  void learn(const CameraPose& pose, bool with_navigation, bool corrected = false);
  /// Time since features last agreed; no track: longer than it is kept.
  [[nodiscard]] double blind_s() const { return blind_s(now_); }
  [[nodiscard]] double blind_s(Time now) const { return locked_ ? (now - t_pose_).seconds() : config_.forget_after_s; }
  /// Once a frame, last: what navigation said, to count its motion from.
  void end_frame(const Prior& nav) { previous_nav_ = nav; }
  void reset();
  /// That pose, known to `px`, with the shape of what is not known.
  [[nodiscard]] Prior around(const CameraPose& pose, double px) const;
  /// rms over a sample of the features of the 1-sigma error of a pose with this covariance, px an axis.
  [[nodiscard]] double spread_px(const CameraPose& pose, const Mat6& P) const;

 private:
  enum Way : std::size_t { kStill, kSteady, kNavigation, kTurning, kPictures, kWays };
  [[nodiscard]] double distance_px(const CameraPose& a, const CameraPose& b) const;
  void choose(const Prior& nav);

  const AlignConfig& config_;
  const Camera& camera_;
  const std::vector<Point<frame::K>>& body_;
  Prior prior_;
  Prior previous_nav_;                  // of the frame before
  Mat6 shape_{Mat6::Zero()};            // newest covariance of navigation: the shape of what is not known
  bool has_shape_{false};
  Time now_{};
  bool locked_{false};                  // there is an aligned pose of an earlier frame
  CameraPose T_{};                      // that pose
  Vec6 velocity_{Vec6::Zero()};         // per second
  Vec6 newest_{Vec6::Zero()};           // velocity between the last two poses, per second
  Vec6 acceleration_{Vec6::Zero()};     // per second squared
  double newest_s_{0};                  // time between them; 0: not known
  Time t_pose_{};
  bool contradicted_{false};
  Time t_nav_{};                        // when navigation was last weighed against it
  bool fresh_{false};                   // that pose is the first one: how it moves is not known
  bool with_navigation_{false};         // that pose was found with navigation's help
  static constexpr std::array<double, kWays> kFirstError_px2{9, 9, 16, 16, 4};
  std::array<CameraPose, kWays> ways_{};  // predictions of this frame
  std::array<bool, kWays> known_{};
  std::array<double, kWays> way_error_px2_{kFirstError_px2};
  Prior pictures_;
  bool astray_{false};                  // it moves as the simple ways do not say
  double words_{1};                     // of navigation, that count as one
};

}  // namespace cyclops::align
