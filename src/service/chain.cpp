#include "service/chain.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace cyclops {
namespace {

constexpr double kAnAxis = 0.849;  // 1 sigma an axis of a distance with the median 1 (Rayleigh)

/// Measures the stages one after the other.
class Stopwatch {
 public:
  Stopwatch() : start_(now()), last_(start_) {}
  void lap(Stage stage, FrameOutput& out) {
    const std::int64_t t = now();
    out.stage_time[static_cast<std::size_t>(stage)] = Duration{t - last_};
    out.chain_time = Duration{t - start_};
    last_ = t;
  }

 private:
  static std::int64_t now() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
  std::int64_t start_;
  std::int64_t last_;
};

/// The same tanker, where the aligner expects it before it has looked.
RelativeState expected(const RelativeState& nav, const Pose<frame::C, frame::R>& T_c_r, const Aligner& aligner) {
  RelativeState state = nav;
  state.T_r_k = T_c_r.inverse() * aligner.prior_pose();
  state.valid = true;
  return state;
}

}  // namespace

const char* to_string(Stage stage) {
  switch (stage) {
    case Stage::kEstimate: return "estimate";
    case Stage::kSegment: return "segment";
    case Stage::kDetect: return "detect";
    case Stage::kAlign: return "align";
    case Stage::kEdge: return "edge";
    case Stage::kPatch: return "patch";
    case Stage::kAssociate: return "associate";
    case Stage::kTrack: return "track";
    case Stage::kPublish: return "publish";
  }
  return "unknown";
}

Chain::Chain(const Rig& rig, const Profile& profile)
    : rig_(rig),
      profile_(profile),
      mount_{camera_from_receiver(rig.mount_angles), rig.lens, rig.boresight_sigma_rad},
      T_c_r_(mount_.R_c_r, Point<frame::C>(-mount_.R_c_r.rotate(mount_.lens.xyz))),
      aligner_(profile.align, rig.tanker, rig.camera, T_c_r_, mount_.boresight_sigma_rad),
      flow_finder_(profile.flow),
      edge_finder_(profile.edge, rig.tanker, rig.camera),
      patch_matcher_(profile.patch, rig.tanker, rig.camera, rig.looks),
      segmenter_(profile.segment),
      detector_(profile.detect, rig.camera.intrinsics().width, rig.camera.intrinsics().height),
      associator_(profile.associate),
      motion_check_(profile.track.motion),
      tracker_(profile.track, rig.camera.intrinsics().width, rig.camera.intrinsics().height),
      nav_carry_(profile.nav) {}

void Chain::step(const AlignedFrame& frame, const ImageView& image, const RowMask* missing, FrameOutput& out) {
  Stopwatch watch;
  out.in = frame;
  out.alignment = {};
  const bool seen = image.data != nullptr && frame.frame.status != FrameStatus::kMissing;
  if (profile_.align.enabled) estimate_aligned(frame, out);
  else estimate(frame, out);
  watch.lap(Stage::kEstimate, out);
  out.sub_images.clear();
  if (seen) segment(out);
  watch.lap(Stage::kSegment, out);
  out.corners.items.clear();
  if (seen) detector_.detect(image, missing, out.sub_images, out.corners);
  out.corners.seq = frame.frame.seq;
  out.corners.t_mid = frame.frame.t_mid;
  watch.lap(Stage::kDetect, out);
  if (profile_.align.enabled) align(frame, seen ? image : ImageView{}, missing, out);
  watch.lap(Stage::kAlign, out);
  find_edges(seen ? image : ImageView{}, missing, out);
  watch.lap(Stage::kEdge, out);
  hold_pose(seen ? image : ImageView{}, missing, out);
  if (out.alignment.consensus && seen) detector_.detect_near(image, missing, out.aligned, out.corners);
  if (out.alignment.consensus && seen) patch_matcher_.measure(image, missing, out.alignment, out.aligned, out.corners);
  watch.lap(Stage::kPatch, out);
  out.tracks_before = tracker_.tracks();
  associator_.associate(out.tracks_before, out.corners, out.matches);
  if (profile_.align.enabled && !out.alignment.consensus) refuse_matches(out);
  if (seen && profile_.track.motion.window_s > 0)
    motion_check_.step(frame.frame.t_mid, expected_motion(frame, out), out.tracks_before, out.corners, out.matches);
  watch.lap(Stage::kAssociate, out);
  if (seen) tracker_.update(out.matches, out.corners);
  out.tracks = tracker_.tracks();
  watch.lap(Stage::kTrack, out);
  measure(out.tracks_before, out.matches, out.corners, rig_.camera, profile_.publish, out.measurements);
  if (profile_.align.enabled) add_scatter(out.alignment, out.measurements);
  refuse_confusable(out.tracks_before, out.matches, profile_.publish.apart_sigmas, out.measurements);
  out.measurements.seq = frame.frame.seq;
  out.measurements.t_mid = frame.frame.t_mid;
  out.measurements.t_mid_sigma = frame.frame.t_mid_sigma;
  if (out.alignment.consensus && seen) flow_finder_.learn(image, missing, out.aligned, out.measurements);
  watch.lap(Stage::kPublish, out);
}

/// How the features move from the last frame to this one, by navigation's velocity and rates; null when those are not known.
const RigidMotion* Chain::rigid_motion(const AlignedFrame& frame) {
  const Time t = frame.frame.t_mid, before = std::exchange(t_before_, t);
  if (profile_.track.filter != Filter::kKalman || aligner_.nav_fault() != NavFault::kNone) return nullptr;
  const RelativeState* now = nav_carry_.at(t, frame.nav.state);
  const RelativeState* then = now == nullptr ? nullptr : nav_carry_.before(before);
  if (then == nullptr || t <= before) return nullptr;
  displace(*then, *now, rig_.tanker, rig_.camera, mount_, motion_);
  motion_.age_s = nav_carry_.age(t).seconds();
  return &motion_;
}

/// The thesis: navigation places the tracks, or they place themselves.
void Chain::estimate(const AlignedFrame& frame, FrameOutput& out) {
  tracker_.begin_frame(frame.frame.t_mid, rigid_motion(frame));
  if (frame.nav.state.valid) {
    predict(frame.nav.state, rig_.tanker, rig_.camera, mount_, profile_.estimate, out.predictions);
    tracker_.nav_update(out.predictions);
  } else {
    predictions_from_tracks(out);
  }
  out.predictions.seq = frame.frame.seq;
  out.predictions.t_mid = frame.frame.t_mid;
}

/// Where to look: navigation and the pose of earlier frames; the tracks follow once the group has been found.
void Chain::estimate_aligned(const AlignedFrame& frame, FrameOutput& out) {
  tracker_.begin_frame(frame.frame.t_mid, rigid_motion(frame));
  const RelativeState* nav = frame.nav.state.valid ? &frame.nav.state : nullptr;
  if (nav != nullptr) predict(*nav, rig_.tanker, rig_.camera, mount_, profile_.estimate, out.predictions);
  else predictions_from_tracks(out);
  if (aligner_.predict(frame.frame.t_mid, nav, nav_carry_.at(frame.frame.t_mid, frame.nav.state))) {
    look_around(frame, out);
  } else {
    out.search = out.predictions;
  }
  out.predictions.seq = out.search.seq = frame.frame.seq;
  out.predictions.t_mid = out.search.t_mid = frame.frame.t_mid;
}

/// Corners do not agree where they were expected: what the pictures say of the motion. False: nothing.
bool Chain::follow(const AlignedFrame& frame, const ImageView& image, const RowMask* missing, FrameOutput& out) {
  constexpr int kTimes = 3;
  for (int n = 0; n < kTimes; ++n) {
    const LandmarkSet& moved = n == 0 ? flow_finder_.find(image, missing, out.search) : flow_finder_.find_again(out.search);
    if (!aligner_.follow(moved, flow_finder_.give_px())) return n > 0;
    look_around(frame, out);
  }
  return true;
}

/// Where to look, from the pose that the aligner expects.
void Chain::look_around(const AlignedFrame& frame, FrameOutput& out) {
  predict(expected(frame.nav.state, T_c_r_, aligner_), rig_.tanker, rig_.camera, mount_, profile_.estimate, out.search);
  aligner_.widen(out.search);
  out.search.seq = frame.frame.seq;
  out.search.t_mid = frame.frame.t_mid;
}

void Chain::predictions_from_tracks(FrameOutput& out) const {
  out.predictions.from_nav = false;
  out.predictions.items.clear();
  for (const Track& t : tracker_.tracks()) {
    Prediction p;
    p.id = t.id;
    p.feature = t.feature;
    const bool on = t.state == TrackState::kLive || t.state == TrackState::kCoasting;
    p.visibility = on ? Visibility::kVisible : Visibility::kHidden;
    p.uv_px = t.uv_px;
    p.cov_px2 = t.cov_px2;
    out.predictions.items.push_back(p);
  }
}

void Chain::segment(FrameOutput& out) {
  points_.clear();
  int reach = 0;
  const bool by_prediction = profile_.align.enabled;
  if (by_prediction) {
    const double most_px = aligner_.acquiring() ? kMaxImageSide : profile_.align.search_most_px;
    for (const Prediction& p : out.search.items) {
      if (p.visibility != Visibility::kVisible) continue;
      points_.push_back(p.uv_px);
      const double sigma = std::sqrt(std::max(p.cov_px2(0, 0), p.cov_px2(1, 1)));
      reach = std::max(reach, static_cast<int>(std::lround(std::min(most_px, profile_.align.search_sigmas * sigma))));
    }
  } else {
    for (const Track& t : tracker_.tracks())
      if (t.state == TrackState::kLive || t.state == TrackState::kCoasting) points_.push_back(t.uv_px);
  }
  segmenter_.segment({points_.begin(), points_.size()}, rig_.camera.intrinsics().width, rig_.camera.intrinsics().height, out.sub_images, reach);
}

void Chain::align(const AlignedFrame& frame, const ImageView& image, const RowMask* missing, FrameOutput& out) {
  aligner_.step(out.search, out.corners, out.alignment);
  if (!out.alignment.consensus && profile_.flow.enabled && image.data != nullptr && follow(frame, image, missing, out)) {
    segment(out);
    detector_.detect(image, missing, out.sub_images, out.corners);
    aligner_.step(out.search, out.corners, out.alignment);
  }
  if (!out.alignment.consensus) recognise(image, missing, out);
  aligner_.search(out.search, out.corners, out.alignment);
  place_aligned(out);
}

/// Corners do not agree: by what earlier frames have shown.
void Chain::recognise(const ImageView& image, const RowMask* missing, FrameOutput& out) {
  Alignment expected;
  out.aligned = out.search;
  if (!aligner_.recall(out.aligned, expected)) return;
  const auto in_view = std::count_if(out.aligned.items.begin(), out.aligned.items.end(), [](const Prediction& p) { return p.visibility == Visibility::kVisible; });
  patch_matcher_.find(image, missing, expected, out.aligned);
  aligner_.recognise(patch_matcher_.landmarks(), static_cast<std::size_t>(in_view), out.alignment);
}

void Chain::place_aligned(FrameOutput& out) {
  if (!out.alignment.consensus) return;
  out.aligned = out.search;
  aligner_.apply(out.alignment, out.aligned);
  out.aligned.from_nav = true;
}

/// Edges refine the pose of the corners.
void Chain::find_edges(const ImageView& image, const RowMask* missing, FrameOutput& out) {
  out.edges.clear();
  if (!profile_.align.enabled || !profile_.edge.enabled || out.alignment.by_landmarks) return;
  edge_finder_.find(image, missing, out.alignment, out.aligned, out.edges);
  aligner_.refine(out.edges, out.alignment);
  place_aligned(out);
  edge_finder_.learn(out.alignment, out.edges);
  edge_finder_.crossings(out.edges, out.corners);
}

/// What earlier frames have shown holds the pose; the tracks follow the final one.
void Chain::hold_pose(const ImageView& image, const RowMask* missing, FrameOutput& out) {
  if (!profile_.align.enabled) return;
  if (!out.alignment.by_landmarks) {
    patch_matcher_.find(image, missing, out.alignment, out.aligned);
    aligner_.hold(patch_matcher_.landmarks(), out.alignment);
    place_aligned(out);
  }
  aligner_.learn(out.alignment);
  out.nav_fault = aligner_.nav_fault();
  out.nav_suspect = out.nav_fault != NavFault::kNone;
  if (out.alignment.consensus) tracker_.nav_update(out.aligned);
}

/// What a corner's own sharpness does not show: that it is not the surveyed point, and that it was chosen by a pose that may be off. A
/// patch has the latter from the aligned prediction.
void Chain::add_scatter(const Alignment& alignment, MeasurementSet& set) const {
  const double shared = kAnAxis * alignment.common_px;
  for (Measurement& m : set.items) {
    if (!m.accepted || m.kind == PointKind::kPatch) continue;
    const double scatter = m.kind == PointKind::kCorner ? aligner_.corner_variance_px2(m.feature) : 0;
    m.cov_px2 += (scatter + shared * shared) * Mat2::Identity();
  }
}

/// Where a pose that knows nothing of single tracks puts the features: the group's, or navigation's carried on.
const PredictionSet* Chain::expected_motion(const AlignedFrame& frame, const FrameOutput& out) {
  if (profile_.align.enabled) return out.alignment.consensus ? &out.aligned : nullptr;
  const RelativeState* state = nav_carry_.at(frame.frame.t_mid, frame.nav.state);
  if (state == nullptr) return nullptr;
  predict(*state, rig_.tanker, rig_.camera, mount_, profile_.estimate, carried_);
  return &carried_;
}

void Chain::refuse_matches(FrameOutput& out) const {
  for (Match& m : out.matches)
    if (m.corner >= 0) {
      m.corner = -1;
      m.reason = MatchReason::kNoConsensus;
      m.gain_px = 0;
    }
}

}  // namespace cyclops
