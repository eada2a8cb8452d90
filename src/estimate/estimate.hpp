#pragma once
/// Where each feature of the tanker model should be in the picture, with a covariance, and whether it can be seen.
///
/// Frames   tanker body -> receiver body -> camera -> pinhole -> lens -> windscreen; results are raw pixels.
/// Time     predictions hold at RelativeState::t.
/// Errors   an invalid state gives an empty set with from_nav false. Nothing else can fail.
/// Threads  stateless: any thread. Memory: no heap.
/// Source   spec 1.2, 2.1, 2.2; covariance: first order, each error source independent of the others.
#include "base/config.hpp"
#include "geometry/camera.hpp"
#include "geometry/tanker_model.hpp"
#include "msg/chain.hpp"
#include "msg/tspi.hpp"

namespace cyclops {

/// How the camera sits in the receiver.
struct CameraMount {
  Rotation<frame::C, frame::R> R_c_r{camera_from_receiver({})};
  Point<frame::R> lens{};             ///< lens centre relative to the receiver's INS, m
  double boresight_sigma_rad{0};      ///< 1 sigma of R_c_r about each camera axis
};

/// Table "estimate". Sigmas are what the navigation covariance does not contain.
struct EstimateConfig {
  bool use_normals{true};             ///< a feature that lists normals is visible if one of them faces the camera, a learnt one from where it was seen; false: thesis
  double focal_sigma{0.001};          ///< 1 sigma of the focal length as a share of it
  double windscreen_sigma_px{1.0};    ///< 1 sigma per axis left by the windscreen calibration; 1 px is spec 3.7
  double survey_scale{1.0};           ///< multiplies the 1 sigma of every feature's place

  /// `table` is [estimate]; range errors are collected there.
  [[nodiscard]] static Result<EstimateConfig> read(ConfigTable& table, EstimateConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const EstimateConfig&) const = default;
};

/// One prediction for every feature, in the order of the model. A disabled feature is projected too; behind the camera, and where
/// the lens model folds back, visibility is kBehindCamera and uv_px stays (0, 0). `out.seq` is the caller's.
void predict(const RelativeState& state, const TankerModel& model, const Camera& camera, const CameraMount& mount,
             const EstimateConfig& config, PredictionSet& out);

/// Every feature's way in the image while the tanker goes from `before` to `now`; what the two places have in common as an error cancels.
/// Not known for a feature behind the camera in one of them. `out.age_s` is the caller's.
void displace(const RelativeState& before, const RelativeState& now, const TankerModel& model, const Camera& camera, const CameraMount& mount,
              RigidMotion& out);

}  // namespace cyclops
