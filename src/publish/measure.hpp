#pragma once
/// Turns matched corners into what navigation gets: image points in metres, covariances, and whether to believe them.
///
/// Frames   raw and ideal pixels; z_m on the image plane, x to image left, y to image top, so that a consumer forms the line of
///          sight in camera axes as (-x, -y, f). Lens and windscreen are removed from the matched corners and from nothing else.
/// Content  one item for each track that was on when association began. `accepted` items were seen in this frame and are
///          what Z(t) is made of; the others say why not, and hold no point unless the reason is kInnovation
///          or that of refuse_confusable.
/// Time     that of the corner set. `t_mid_sigma` of the output is the caller's.
/// Threads  stateless: any thread. Memory: no heap.
/// Source   spec 2.9 and 1.2; innovation tests as usual in Kalman filtering (normalised innovation squared, NIS).
#include <array>

#include "base/config.hpp"
#include "geometry/camera.hpp"
#include "msg/chain.hpp"

namespace cyclops {

/// Table "publish".
struct PublishConfig {
  double max_nis{0};                  ///< a match with more is listed but not accepted; 0: no such test (the thesis)
  double apart_sigmas{0};             ///< see refuse_confusable; 0: nothing is refused by it (the thesis)
  double typical_nis{5.99};           ///< 95 % of 2 degrees of freedom; only for integrity
  int enough_features{6};             ///< accepted features from which on their number does not lower integrity

  /// `table` is [publish]; range errors are collected there.
  [[nodiscard]] static Result<PublishConfig> read(ConfigTable& table, PublishConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const PublishConfig&) const = default;
};

/// `predicted`: the tracks as association saw them. matches[i] belongs to predicted[i].
///
/// integrity = share * consistency * number, each 0..1:
///   share        accepted / tracks that were on
///   consistency  share of matches with a NIS up to typical_nis, over 0.95, at most 1
///   number       accepted / enough_features, at most 1
void measure(const TrackSet& predicted, const MatchSet& matches, const CornerSet& corners, const Camera& camera,
             const PublishConfig& config, MeasurementSet& out);

/// Refuses (kAmbiguous) each accepted measurement that cannot be told from another feature in view: of the way to where that one is
/// predicted, half is less than `apart_sigmas` of the measurement's own. Call when its covariance is final. Raw
/// and ideal pixels are taken for the same over so short a way. Integrity stays: what is refused here was found as expected.
void refuse_confusable(const TrackSet& predicted, const MatchSet& matches, double apart_sigmas, MeasurementSet& set);

/// Z(t): first row [t 1 1], then [id x y] in metres of each accepted feature.
using ZMatrix = StaticVector<std::array<double, 3>, kMaxFeatures + 1>;
void z_matrix(const MeasurementSet& set, double t_s, ZMatrix& out);

}  // namespace cyclops
