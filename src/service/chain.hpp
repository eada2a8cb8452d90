#pragma once
/// estimate -> segment -> detect -> align -> edge -> patch -> associate -> track -> publish, for one frame. Where corners do not agree: flow,
/// and from segment to align once more.
///
/// Threads  one at a time; no heap after construction. Deterministic: `times` is the only output that is not.
#include "align/align.hpp"
#include "associate/associate.hpp"
#include "detect/corner_detector.hpp"
#include "edge/edge_finder.hpp"
#include "estimate/estimate.hpp"
#include "flow/flow_finder.hpp"
#include "msg/chain.hpp"
#include "msg/frame.hpp"
#include "nav/frame_aligner.hpp"
#include "nav/nav_carry.hpp"
#include "patch/patch_matcher.hpp"
#include "publish/measure.hpp"
#include "service/rig.hpp"
#include "segment/segment.hpp"
#include "service/profile.hpp"
#include "track/tracker.hpp"

namespace cyclops {

enum class Stage : std::uint8_t { kEstimate, kSegment, kDetect, kAlign, kEdge, kPatch, kAssociate, kTrack, kPublish };
inline constexpr std::size_t kStages = 9;
[[nodiscard]] const char* to_string(Stage stage);

/// Everything known about one frame at the end of the chain. Large: owned by the caller and used again.
struct FrameOutput {
  AlignedFrame in{};
  PredictionSet predictions{};  ///< navigation's when there is any, else those of the tracks
  PredictionSet search{};       ///< where was looked: navigation and the pose of earlier frames together
  PredictionSet aligned{};      ///< moved to the common pose; only with alignment.consensus
  SubImageSet sub_images{};
  CornerSet corners{};
  Alignment alignment{};
  NavFault nav_fault{NavFault::kNone};
  bool nav_suspect{false};    ///< it has one
  EdgeSet edges{};            ///< found in this frame, proven or not
  MatchSet matches{};
  TrackSet tracks_before{};   ///< moved to this frame, before association
  TrackSet tracks{};
  MeasurementSet measurements{};
  Duration stage_time[kStages]{};
  Duration chain_time{};
};

class Chain {
 public:
  /// `rig` must outlive the chain.
  Chain(const Rig& rig, const Profile& profile);
  /// `image.data` null or status kMissing: tracks coast, nothing is searched.
  void step(const AlignedFrame& frame, const ImageView& image, const RowMask* missing, FrameOutput& out);
  [[nodiscard]] const TrackCounters& track_counters() const { return tracker_.counters(); }
  [[nodiscard]] const AssociateCounters& associate_counters() const { return associator_.counters(); }

 private:
  void estimate(const AlignedFrame& frame, FrameOutput& out);
  void estimate_aligned(const AlignedFrame& frame, FrameOutput& out);
  void look_around(const AlignedFrame& frame, FrameOutput& out);
  bool follow(const AlignedFrame& frame, const ImageView& image, const RowMask* missing, FrameOutput& out);
  void predictions_from_tracks(FrameOutput& out) const;
  void segment(FrameOutput& out);
  void align(const AlignedFrame& frame, const ImageView& image, const RowMask* missing, FrameOutput& out);
  void recognise(const ImageView& image, const RowMask* missing, FrameOutput& out);
  void place_aligned(FrameOutput& out);
  void find_edges(const ImageView& image, const RowMask* missing, FrameOutput& out);
  void hold_pose(const ImageView& image, const RowMask* missing, FrameOutput& out);
  void add_scatter(const Alignment& alignment, MeasurementSet& set) const;
  void refuse_matches(FrameOutput& out) const;
  const RigidMotion* rigid_motion(const AlignedFrame& frame);
  const PredictionSet* expected_motion(const AlignedFrame& frame, const FrameOutput& out);

  const Rig& rig_;
  Profile profile_;
  CameraMount mount_;
  Pose<frame::C, frame::R> T_c_r_;
  Aligner aligner_;
  FlowFinder flow_finder_;
  EdgeFinder edge_finder_;
  PatchMatcher patch_matcher_;
  Segmenter segmenter_;
  CornerDetector detector_;
  Associator associator_;
  MotionCheck motion_check_;
  Tracker tracker_;
  NavCarry nav_carry_;
  PredictionSet carried_{};              ///< where navigation, carried on, expects the features; only where they stand alone
  RigidMotion motion_{};
  Time t_before_{};                      ///< of the last frame
  StaticVector<Vec2, kMaxFeatures> points_{};
};

}  // namespace cyclops
