#pragma once
/// What travels from estimate to publish. All points are raw pixels unless the name says otherwise.
#include <cstdint>

#include "base/static_vector.hpp"
#include "base/time.hpp"
#include "geometry/frames.hpp"
#include "msg/limits.hpp"

namespace cyclops {

using FeatureId = std::int32_t;

enum class Visibility : std::uint8_t { kVisible, kBehindCamera, kOutsideImage, kFacingAway, kHidden, kDisabled };

/// Where one feature of the model should be in the image.
struct Prediction {
  FeatureId id{0};
  std::uint16_t feature{0};            ///< index into the tanker model
  Visibility visibility{Visibility::kDisabled};
  Vec2 uv_px{0, 0};                    ///< valid unless kBehindCamera
  Mat2 cov_px2{Mat2::Identity()};      ///< of the prediction, from navigation, boresight, lens and survey
  double range_m{0};                   ///< lens to feature
};

struct PredictionSet {
  std::uint64_t seq{0};
  Time t_mid{};
  bool from_nav{false};                ///< false: carried on from the tracks
  StaticVector<Prediction, kMaxFeatures> items{};
};

/// How far one feature moves in the image from the frame before to this one.
struct Displacement {
  bool known{false};
  Vec2 px{0, 0};
};

/// The same of all features, by navigation's velocity and rates.
struct RigidMotion {
  double age_s{0};                     ///< of the update that they are of; what has changed them since is not known
  StaticVector<Displacement, kMaxFeatures> items{};  ///< item i is feature i
};

/// Part of the image that is searched: rows v0..v0+height-1, columns u0..u0+width-1.
struct SubImage {
  int u0{0};
  int v0{0};
  int width{0};
  int height{0};
  int features{0};                     ///< how many predicted points are inside
};
using SubImageSet = StaticVector<SubImage, kMaxSubImages>;

/// How an image point was found.
enum class PointKind : std::uint8_t {
  kCorner,      ///< corner of the image
  kCrossing,    ///< where edges cross that end at the feature
  kPatch,       ///< where the surroundings of the feature look as they did before
};

struct Corner {
  Vec2 uv_px{0, 0};
  Mat2 cov_px2{Mat2::Identity()};      ///< localisation covariance, order u v
  float measure{0};                    ///< Noble corner measure, counts^2
  bool subpixel{false};                ///< false: centre of the strongest pixel
  PointKind kind{PointKind::kCorner};
  std::int32_t feature{-1};            ///< index into the model: the only feature this point can be; -1: any
};

struct CornerSet {
  std::uint64_t seq{0};
  Time t_mid{};
  StaticVector<Corner, kMaxCorners> items{};
  std::uint32_t overflow{0};           ///< corners that found no room
  std::uint32_t unreadable_px{0};      ///< pixels masked: missing rows, saturation
};

/// A feature found by what has surrounded it in earlier frames: where it is does not depend on this frame's corners.
struct Landmark {
  std::uint16_t feature{0};
  Vec2 uv_px{0, 0};                    ///< raw px
  Mat2 cov_px2{Mat2::Identity()};
};
using LandmarkSet = StaticVector<Landmark, kMaxFeatures>;

/// What is wrong with navigation, by the picture.
enum class NavFault : std::uint8_t {
  kNone,
  kPositionStep,       ///< what it says of the place has changed in a way that its motion and the picture have not
  kAttitudeStep,
  kMotion,             ///< it does not move as it says: frozen, or of something else
  kDisagrees,          ///< further from the picture than its covariance allows
};

/// What the group of all features says about the pose in front of the camera: navigation's own, corrected.
struct Alignment {
  bool consensus{false};               ///< false: nothing below may be used
  std::uint32_t inliers{0};            ///< corners that agree, each counted once
  std::uint32_t considered{0};         ///< features that could have
  double evidence{0};                  ///< sum of log-likelihood ratios, feature against clutter
  double margin{0};                    ///< evidence minus that of the best other reading
  double nav_disagreement{0};          ///< squared Mahalanobis distance of navigation from the aligned pose, 6 degrees of freedom; 0 without navigation
  bool from_track{false};              ///< the prior was the aligned pose of earlier frames
  bool by_landmarks{false};            ///< corners did not agree, landmarks did; then `inliers` are those
  Pose<frame::C, frame::K> T_c_k{};    ///< aligned; holds boresight error too, so it is a pose for the image only
  Mat6 covariance{Mat6::Identity()};   ///< [rotation vector about the tanker INS in c axes (rad); translation in c (m)]
  double residual_px{0};               ///< median distance of a supporting corner from its feature
  double common_px{0};                 ///< 1 sigma an axis of an error that all features share and the covariance does not hold
};

/// A straight edge between two features, as seen in the image: two points of it with normals and independent errors.
struct Edge {
  std::uint32_t pair{0};               ///< of the finder
  std::uint16_t feature[2]{};
  struct Point {
    double share{0};                   ///< place on the segment in space: 0 at the first feature, 1 at the second
    Vec2 uv_px{0, 0};
    Vec2 normal{0, 0};                 ///< unit; the place along the edge is not known
  };
  Point inner[2];                      ///< errors along their normals are independent, 1 sigma is `sigma_px`
  Point end[2];                        ///< the line carried on to the features
  double sigma_px{0};
  double bias_sigma_px{0};             ///< 1 sigma of the edge about the segment of the model, the same for all its points
  double coverage{0};                  ///< share of the segment where the edge was seen
  bool proven{false};                  ///< found often enough to be used
};
using EdgeSet = StaticVector<Edge, 128>;

enum class MatchReason : std::uint8_t {
  kMatched,
  kNoCornerInGate,     ///< nothing to match within the gate
  kLostToOther,        ///< a corner was there, another track had the better claim
  kNotVisible,
  kInnovation,         ///< matched, then refused by the consistency test
  kNoConsensus,        ///< the features together do not confirm where the tanker is
  kAgainstMotion,      ///< what was matched does not move as the feature should
  kAmbiguous,          ///< a corner was there, but whose it is cannot be told
};

/// The outcome of association for one track, in the order of the tracks.
struct Match {
  std::int32_t corner{-1};             ///< index into the corner set; -1 = unmatched
  MatchReason reason{MatchReason::kNoCornerInGate};
  double gain_px{0};                   ///< gate minus distance, 0 when unmatched; Mahalanobis gate: log-likelihood ratio
  float gate_px{0};                    ///< radius searched around the track
};
using MatchSet = StaticVector<Match, kMaxFeatures>;

enum class TrackState : std::uint8_t { kNone, kLive, kCoasting, kDeleted };

enum class TrackChange : std::uint8_t {
  kNone,
  kInitiatedByNav,
  kReplacedByNav,      ///< a live track moved to the projected position
  kHit,
  kMiss,
  kDeletedByScore,
  kLeftImage,          ///< removed, and not counted as dropped
  kTurnedAway,         ///< the model says it can no longer be seen
  kAgainstMotion,      ///< removed: what it followed does not move as the feature should
};

struct Track {
  FeatureId id{0};
  std::uint16_t feature{0};
  TrackState state{TrackState::kNone};
  TrackChange change{TrackChange::kNone};
  Vec2 uv_px{0, 0};                    ///< predicted for this frame before association, updated after
  Vec2 velocity_px_s{0, 0};
  Mat2 cov_px2{Mat2::Identity()};
  int score{0};                        ///< misses less hits, floor 0
  double log_likelihood{0};            ///< that it follows the feature and not clutter, against chance; since it was started
  Time t_last_hit{};
};
using TrackSet = StaticVector<Track, kMaxFeatures>;

/// What is handed to navigation for one feature in one frame. Spec 2.9.
struct Measurement {
  FeatureId id{0};
  std::uint16_t feature{0};
  bool accepted{false};                ///< false: listed for diagnosis, not part of Z(t)
  MatchReason reason{MatchReason::kMatched};
  PointKind kind{PointKind::kCorner};
  Vec2 raw_px{0, 0};
  Vec2 ideal_px{0, 0};                 ///< lens and windscreen removed
  Vec2 z_m{0, 0};                      ///< metres on the image plane, x image left, y image top
  Mat2 cov_px2{Mat2::Identity()};      ///< of ideal_px
  Vec2 innovation_px{0, 0};            ///< raw_px minus the place predicted for it
  Mat2 innovation_cov_px2{Mat2::Identity()};
  double nis{0};                       ///< innovation squared over its covariance, 2 degrees of freedom
  float corner_measure{0};
  float gate_px{0};
};

struct MeasurementSet {
  std::uint64_t seq{0};
  Time t_mid{};
  Duration t_mid_sigma{};
  StaticVector<Measurement, kMaxFeatures> items{};
  double integrity{0};                 ///< 0 no trust .. 1: see docs/icd.md
};

}  // namespace cyclops
