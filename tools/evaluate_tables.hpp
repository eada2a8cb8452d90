#pragma once
/// What one run did beside the truth of its flight, as tables that NumPy reads: the raw material of `make evaluate`.
///
/// Tables   features.npy: one row a frame and feature of the truth; frames.npy: one row a frame; both structured arrays whose columns
///          are named in evaluate_tables.cpp. Pixels are raw unless a column says ideal; NaN where there is nothing.
/// Learnt   with a learnt model its features have no truth of their own: each is where the true pose (tools/true_pose.hpp) puts its
///          place in the model, visible from where the model says that it can be seen. The error so holds that of the place.
/// Times    service clock, ns; stages in microseconds.
/// Errors   truth that does not decode; a table that cannot be written.
/// Threads  one at a time. Any tracker can be recorded: it fills the parts of FrameOutput that are read here (predictions,
///          tracks_before, tracks, measurements, alignment, times).
#include <map>
#include <string>
#include <vector>

#include <cyclops/truth_t.hpp>

#include "align/pose.hpp"
#include "base/result.hpp"
#include "service/chain.hpp"

namespace cyclops::tools {

#pragma pack(push, 1)
struct FeatureRow {
  std::int32_t frame{0};              ///< index into frames.npy
  std::int32_t id{0};
  std::int8_t truth{0};               ///< truth_t: 0 hidden, 1 visible, 2 do not score
  std::int8_t predicted{0};           ///< 1: predicted_* holds where navigation or the tracks put it
  std::int8_t before{0};              ///< 1: before_* holds where the track was before this frame was looked at
  std::int8_t measured{0};            ///< 1: accepted
  std::int8_t kind{-1};               ///< PointKind of what was accepted
  std::int8_t reason{-1};             ///< MatchReason; -1: not looked for
  std::int8_t track_state{0};
  std::int8_t track_change{0};
  double true_u{0}, true_v{0};
  double true_ideal_u{0}, true_ideal_v{0};
  double u{0}, v{0}, ideal_u{0}, ideal_v{0};
  float predicted_u{0}, predicted_v{0};
  float before_u{0}, before_v{0};
  float cov_uu{0}, cov_uv{0}, cov_vv{0};  ///< of the ideal pixel, px2
  float nis{0};
  float nearest_other{0};             ///< px from the measurement to the nearest other visible feature's true place
};
struct FrameRow {
  std::int64_t t_mid_ns{0};
  std::int8_t has_truth{0};
  std::int8_t nav_update{0};          ///< navigation placed the predictions of this frame
  std::int8_t consensus{0};
  std::int8_t nav_suspect{0};
  std::int8_t has_pose{0};            ///< of the truth; then pose_* is a start for T_c_k
  float integrity{0};
  float range_m{0};                   ///< lens to tanker INS, by truth; NaN without a pose
  float chain_us{0};
  float stage_us[kStages]{};
  double pose_t[3]{};                 ///< true T_r_k seen through the mount of the rig file, which has the flight's boresight error
  double pose_q[4]{};
};
#pragma pack(pop)

/// Where a feature really is in a frame, raw and ideal pixels; `visible` as truth_t says it.
struct TruePoint {
  std::int32_t id{0};
  Vec2 uv_px{0, 0}, ideal_px{0, 0};
  std::int8_t visible{0};
};

class EvaluationTables {
 public:
  /// `first_frame`: frames before it are left out of the tables.
  static Result<EvaluationTables> create(const std::string& flight, std::int64_t first_frame = 0);
  void add(const Rig& rig, const FrameOutput& out);
  /// features.npy, frames.npy and rig.json (camera, features, stages, first frame) into a folder that exists.
  Result<> write(const Rig& rig, const std::string& folder) const;
  [[nodiscard]] const std::vector<FeatureRow>& features() const { return features_; }
  [[nodiscard]] const std::vector<FrameRow>& frames() const { return frames_; }

 private:
  void add_row(const FrameOutput& out, const std::vector<TruePoint>& all, const TruePoint& point);

  TankerModel own_;                   // the flight's, which the truth speaks of
  std::map<std::int64_t, truth_t> truth_;
  std::int64_t first_frame_{0}, seen_{0};
  align::CameraPose last_{};          // true, of the last frame
  std::vector<FeatureRow> features_;
  std::vector<FrameRow> frames_;
};

}  // namespace cyclops::tools
