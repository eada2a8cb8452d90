#pragma once
/// The LCM channels, see docs/icd.md.
#include "msg/tspi.hpp"

namespace cyclops::channel {

inline constexpr const char* kTspiReceiver = "TSPI_RECEIVER";  // tspi_t, in
inline constexpr const char* kTspiTanker = "TSPI_TANKER";      // tspi_t, in
inline constexpr const char* kTimeMark = "TIME_MARK";          // time_mark_t, in
inline constexpr const char* kStrobe = "STROBE";               // strobe_edge_t, only in files
inline constexpr const char* kFrame = "FRAME";                 // frame_index_t, out
inline constexpr const char* kFrameData = "FRAME_DATA";        // frame_data_t, only in files
inline constexpr const char* kNav = "NAV";                     // nav_state_t, out
inline constexpr const char* kPrediction = "PREDICTION";       // prediction_set_t, out
inline constexpr const char* kSubImage = "SUBIMAGE";           // subimage_set_t, out
inline constexpr const char* kCorner = "CORNER";               // corner_set_t, out
inline constexpr const char* kTrack = "TRACK";                 // track_set_t, out
inline constexpr const char* kMeasurement = "MEASUREMENT";     // measurement_set_t, out
inline constexpr const char* kHealth = "HEALTH";               // health_t, out
inline constexpr const char* kClock = "CLOCK";                 // clock_state_t, out
inline constexpr const char* kEvent = "EVENT";                 // event_t, out
inline constexpr const char* kAcquisition = "ACQUISITION";     // acquisition_t, only in files
inline constexpr const char* kSeal = "SEAL";                   // seal_t, only in files
inline constexpr const char* kMark = "CYCLOPS_MARK";           // mark_t, in
inline constexpr const char* kTruth = "TRUTH";                 // truth_t, only in files
inline constexpr const char* kSignedPrefix = "SIGNED_";        // before the name of a channel: signed_t, in; only with --key

[[nodiscard]] constexpr const char* tspi(Aircraft aircraft) {
  return aircraft == Aircraft::kReceiver ? kTspiReceiver : kTspiTanker;
}

}  // namespace cyclops::channel
