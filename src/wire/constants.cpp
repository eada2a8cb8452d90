// The enums of msg/ and the constants of lcmtypes/ are the same numbers. Checked here, once, by the compiler.
#include "wire/encode.hpp"

namespace cyclops {
namespace {

template <class E>
constexpr bool is(E e, int constant) {
  return static_cast<int>(e) == constant;
}

static_assert(is(Aircraft::kReceiver, tspi_t::RECEIVER) && is(Aircraft::kTanker, tspi_t::TANKER));

static_assert(is(FrameStatus::kComplete, frame_index_t::COMPLETE) && is(FrameStatus::kPartial, frame_index_t::PARTIAL) &&
              is(FrameStatus::kMissing, frame_index_t::MISSING));
static_assert(is(TimeSource::kStrobe, frame_index_t::TIME_STROBE) && is(TimeSource::kCameraTick, frame_index_t::TIME_CAMERA_TICK) &&
              is(TimeSource::kArrival, frame_index_t::TIME_ARRIVAL) && is(TimeSource::kUnknown, frame_index_t::TIME_UNKNOWN));
static_assert(is(PixelFormat::kMono8, frame_index_t::MONO8) && is(PixelFormat::kMono10, frame_index_t::MONO10) &&
              is(PixelFormat::kMono12, frame_index_t::MONO12) && is(PixelFormat::kMono16, frame_index_t::MONO16));

static_assert(is(StrobeLine::kStrobe, 0) && is(StrobeLine::kPps, 1));
static_assert(is(MarkSource::kPps, time_mark_t::PPS) && is(MarkSource::kTspiArrival, time_mark_t::TSPI_ARRIVAL) &&
              is(MarkSource::kRecorded, time_mark_t::RECORDED));

// nav_state_t.absence has no named constants: the numbers are in its comment.
static_assert(is(NavAbsence::kNone, 0) && is(NavAbsence::kNoReceiver, 1) && is(NavAbsence::kNoTanker, 2) && is(NavAbsence::kNoBoth, 3) &&
              is(NavAbsence::kTooOldReceiver, 4) && is(NavAbsence::kTooOldTanker, 5) && is(NavAbsence::kNotScheduled, 6) &&
              is(NavAbsence::kNoFrameTime, 7));

static_assert(is(Visibility::kVisible, prediction_t::VISIBLE) && is(Visibility::kBehindCamera, prediction_t::BEHIND_CAMERA) &&
              is(Visibility::kOutsideImage, prediction_t::OUTSIDE_IMAGE) && is(Visibility::kFacingAway, prediction_t::FACING_AWAY) &&
              is(Visibility::kHidden, prediction_t::HIDDEN) && is(Visibility::kDisabled, prediction_t::DISABLED));

static_assert(is(TrackState::kNone, track_t::NONE) && is(TrackState::kLive, track_t::LIVE) && is(TrackState::kCoasting, track_t::COASTING) &&
              is(TrackState::kDeleted, track_t::DELETED));
static_assert(is(TrackChange::kNone, track_t::CHANGE_NONE) && is(TrackChange::kInitiatedByNav, track_t::INITIATED_BY_NAV) &&
              is(TrackChange::kReplacedByNav, track_t::REPLACED_BY_NAV) && is(TrackChange::kHit, track_t::HIT) &&
              is(TrackChange::kMiss, track_t::MISS) && is(TrackChange::kDeletedByScore, track_t::DELETED_BY_SCORE) &&
              is(TrackChange::kLeftImage, track_t::LEFT_IMAGE) && is(TrackChange::kTurnedAway, track_t::TURNED_AWAY) &&
              is(TrackChange::kAgainstMotion, track_t::AGAINST_MOTION));

static_assert(is(MatchReason::kMatched, measurement_t::MATCHED) && is(MatchReason::kNoCornerInGate, measurement_t::NO_CORNER_IN_GATE) &&
              is(MatchReason::kLostToOther, measurement_t::LOST_TO_OTHER) && is(MatchReason::kNotVisible, measurement_t::NOT_VISIBLE) &&
              is(MatchReason::kInnovation, measurement_t::INNOVATION) && is(MatchReason::kNoConsensus, measurement_t::NO_CONSENSUS) &&
              is(MatchReason::kAgainstMotion, measurement_t::AGAINST_MOTION) && is(MatchReason::kAmbiguous, measurement_t::AMBIGUOUS));

static_assert(is(PointKind::kCorner, measurement_t::CORNER) && is(PointKind::kCrossing, measurement_t::CROSSING) && is(PointKind::kPatch, measurement_t::PATCH));
static_assert(is(TruthVisibility::kHidden, truth_t::HIDDEN) && is(TruthVisibility::kVisible, truth_t::VISIBLE) &&
              is(TruthVisibility::kDoNotScore, truth_t::DO_NOT_SCORE));
// The reasons are a mask: one bit each, none left out (decode_truth takes all below twice the last). hil/ compares its own.
static_assert((truth_t::OUT_OF_FIELD | truth_t::FACES_AWAY | truth_t::OCCLUDED | truth_t::IN_SHADOW | truth_t::SATURATED | truth_t::AT_BORDER |
               truth_t::GRAZING | truth_t::HALF_HIDDEN | truth_t::BLOWN_OUT) == 2 * truth_t::BLOWN_OUT - 1);
static_assert(is(EventLevel::kInfo, event_t::INFO) && is(EventLevel::kWarning, event_t::WARNING) && is(EventLevel::kFault, event_t::FAULT) &&
              is(EventLevel::kRecovery, event_t::RECOVERY) && is(EventLevel::kMark, event_t::MARK));

}  // namespace
}  // namespace cyclops
