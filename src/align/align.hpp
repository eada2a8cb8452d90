#pragma once
/// Finds the error that all predictions share. Navigation, boresight and lens errors move every feature together; the
/// corners that are features agree on that motion, clutter does not. Which pose, within what navigation says of its own
/// uncertainty, do most corners support, and is there a second reading that is nearly as good?
///
/// Method   One correspondence conditions the six pose errors on its displacement; every feature-corner pair is tried as
///          that one. The best few are grown, most certain feature first, into full readings; each is rated by its
///          evidence: sum over features of log( P_D N(residual) / clutter density ). The winner is refined by
///          iteratively reweighted Gauss-Newton with the prior. It counts only with enough evidence, enough features
///          and enough margin to the next different reading. The idea of one-point hypotheses from a prior is that of
///          Civera et al. 2010 (1-point RANSAC for EKF), here exhaustive and with a likelihood instead of a count.
/// Search   Where that finds nothing, or less than it should, or where navigation says that it may be metres off, the pose is searched for
///          (acquire.hpp). What that finds without a pose of a moment ago is not measured with until the next frame agrees.
/// Memory   Where corners do not agree although they did a moment ago, landmarks may: what was found again of earlier frames, near the pose
///          that those expect. For kMemory_s, as landmarks are learnt where corners agree.
/// Prior    Twice a frame: navigation alone, and navigation fused with the pose of the last frame moved on. The second
///          is as uncertain as it has recently proved to be (in px), never more certain than `track_floor_px`.
/// Frames   raw pixels; poses camera from tanker body. Time: all inputs at the same t_mid.
/// Threads  one at a time. Memory: everything on construction. Deterministic, no random numbers.
#include <memory>

#include "align/align_config.hpp"
#include "geometry/camera.hpp"
#include "geometry/tanker_model.hpp"
#include "msg/chain.hpp"
#include "msg/tspi.hpp"

namespace cyclops {

class Aligner {
 public:
  /// `T_c_r`: camera from receiver body; `boresight_sigma_rad` about each camera axis.
  Aligner(const AlignConfig& config, const TankerModel& model, const Camera& camera, const Pose<frame::C, frame::R>& T_c_r,
          double boresight_sigma_rad);
  ~Aligner();
  Aligner(const Aligner&) = delete;
  Aligner& operator=(const Aligner&) = delete;

  /// Where to look in this frame. `nav` may be null or invalid; `carried` is what an earlier update says of this frame, or null: it keeps
  /// the pose of earlier frames from wandering, but is no navigation to compare with. False: neither navigation nor an earlier pose helps.
  bool predict(Time t_mid, const RelativeState* nav, const RelativeState* carried = nullptr);
  [[nodiscard]] const Pose<frame::C, frame::K>& prior_pose() const;
  /// After predict: where the features of the last frame that agreed have gone, by the pictures; they were looked for up to `give_px` from
  /// the motion of the group. The prior follows when they move as one body. False: they do not.
  bool follow(const LandmarkSet& moved, double give_px);

  /// The prior is so wide that features have to be looked for all over it.
  [[nodiscard]] bool acquiring() const;

  /// Gives every prediction the place and covariance of the prior: where the feature has to be looked for.
  void widen(PredictionSet& predicted) const;

  /// `predicted` says which features can be seen; its positions are not used. Call after predict, once a frame.
  void step(const PredictionSet& predicted, const CornerSet& corners, Alignment& out);

  /// Corners do not agree: where earlier frames expect the features, to look for landmarks. False: they expect nothing.
  bool recall(PredictionSet& predicted, Alignment& expected) const;
  /// The pose that the landmarks found there agree on, if they do. `in_view`: features that could have been found.
  void recognise(const LandmarkSet& landmarks, std::size_t in_view, Alignment& out);

  /// Searches for the pose, where there is none or a doubtful one. Call after step and recognise, once a frame.
  void search(const PredictionSet& predicted, const CornerSet& corners, Alignment& out);

  /// Refines the pose of step() with edges that were found from it, corners included again. Edges not proven are not used.
  void refine(const EdgeSet& edges, Alignment& out);

  /// Moves the pose of step() and refine() as far as what was found again from earlier frames says against what its covariance says. That
  /// covariance stays: what the landmarks were learnt from are poses of the same corners. Not where the pose has just been corrected.
  void hold(const LandmarkSet& landmarks, Alignment& out);

  /// What this frame teaches about predicting the next, and about navigation. Call last, once a frame.
  void learn(const Alignment& alignment);

  /// What is wrong with navigation (nav_step.hpp, nav_watch.hpp). Until it is over the pose goes on from the picture, and no search has to
  /// agree with navigation.
  [[nodiscard]] NavFault nav_fault() const;

  /// Moves every prediction to the aligned pose, covariance from the alignment, survey and lens.
  void apply(const Alignment& alignment, PredictionSet& predicted) const;

  /// What a corner of this feature has recently been off the common pose, px^2 an axis: part of an honest covariance.
  [[nodiscard]] double corner_variance_px2(std::uint16_t feature) const;

  void reset();

 private:
  struct State;
  std::unique_ptr<State> s_;
};

}  // namespace cyclops
