#pragma once
/// Offset and drift between the clock of the frames and that of TSPI, from the whole waveform of roll (spec 3.4):
///
///   t_tspi = t_frame + offset + drift (t_frame - t_mid)          t_mid: middle of the frames
///
/// Model      measured roll = gain * TSPI's roll at t_tspi + a slow line (knots every 10 s): boresight, what attitude errors do
///            slowly, and the change of the shape with range take no part. Huber weights.
/// Search     offset on a grid over +-search_s with drift 0, then least squares for all. A second place of the grid that fits
///            nearly as well makes the answer ambiguous, which is said.
/// Sigma      from the residuals as they are, correlated in time: the larger of two, from the frames' own products (Newey & West
///            1987, Bartlett kernel of 1.5 s; sees that residuals grow in manoeuvres) and from the autocovariance of the whole flight
///            (6 s; sees slow ones). Where the manoeuvres scatter more than that allows, it grows by the root of their reduced chi square.
/// Errors     none: what cannot be answered is `enough` = false with the reason.
/// Threads    pure.
#include <functional>
#include <string>
#include <vector>

namespace cyclops::tools {

struct RollSeries {                      ///< measured, one a frame, in order of time
  std::vector<double> t_s;               ///< what the frame's stamp says, on TSPI's time scale
  std::vector<double> roll_rad;
};

/// TSPI's roll for the features of a frame at any time; NaN where TSPI does not reach.
using RollAt = std::function<double(std::size_t frame, double t_s)>;

struct WingRockConfig {
  double search_s{5};
  double manoeuvre_dps{4};               ///< roll rate from which on it is one
  double least_roll_deg{4};              ///< peak to peak
  double most_sigma_s{0.017};            ///< half a frame (spec 3.4): less exact is no answer
};

struct Manoeuvre {
  double begin_s{0}, end_s{0};           ///< frame time
  double roll_deg{0};                    ///< peak to peak, TSPI
  double offset_s{0}, sigma_s{0};        ///< its own, on top of the fit of all: 0 if the line holds
};

struct WingRockResult {
  bool enough{false};
  std::string reason;                    ///< why not
  double offset_s{0}, offset_sigma_s{0};
  bool has_drift{false};                 ///< manoeuvres lie far enough apart
  double drift{0}, drift_sigma{0};       ///< s a second
  double t_mid_s{0};
  double gain{0}, gain_sigma{0};         ///< 1 when TSPI and picture roll alike
  double correlation{0};                 ///< of measured roll and fit, slow line removed
  double residual_deg{0};                ///< rms
  double runner_up{0};                   ///< sum of squares of the second best place over the best's
  double chi2{1};                        ///< reduced, of the manoeuvres about the line
  std::vector<Manoeuvre> manoeuvres;
  std::vector<double> fitted_rad;        ///< by frame, NaN where not used
};

[[nodiscard]] WingRockResult wing_rock(const RollSeries& seen, const RollAt& tspi, const WingRockConfig& config = {});

}  // namespace cyclops::tools
