#pragma once
/// Inside align: what an Aligner holds, and its steps. align.cpp leads from frame to frame, aligner_read.cpp reads corners under a prior,
/// aligner_search.cpp finds the pose again where that fails.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "align/acquire.hpp"
#include "align/align.hpp"
#include "align/anchor.hpp"
#include "align/common_error.hpp"
#include "align/nav_step.hpp"
#include "align/nav_watch.hpp"
#include "align/pose_track.hpp"

namespace cyclops {

struct Aligner::State {
  /// What a prior expects of the frame, and the best reading of the corners under it.
  struct View {
    align::Prior prior;
    align::Problem problem;
    double clutter{0};                 // corners / px^2 where it looks
    bool read{false};                  // the next two are known
    align::Reading best;
    double margin{0};                  // evidence over that of the next different reading
    double spread_px{0};               // 1 sigma of the prior on the image, rms of the features, an axis
  };
  State(const AlignConfig& c, const TankerModel& m, const Camera& k, const Pose<frame::C, frame::R>& mount, double b)
      : config(c), model(m), camera(k), T_c_r(mount), boresight(b), track(config, k, body), common(config), acquirer(config, k, body) {
    const std::size_t n = std::min(model.features().size(), kMaxFeatures);
    body.reserve(n);
    for (const Feature& f : model.features()) body.push_back(model.in_body(f));
    for (View* v : {&by_nav, &by_track, &by_search}) {
      v->problem.seen.reserve(n);
      v->problem.corner.reserve(n * static_cast<std::size_t>(config.candidates));
    }
    scatter.assign(n, config.corner_sigma_px * config.corner_sigma_px);
    scatter_frames.assign(n, 0);
    residuals.reserve(n);
    supporters.reserve(n);
    readings.reserve(static_cast<std::size_t>(config.readings) + 1);
  }

  AlignConfig config;
  const TankerModel& model;
  const Camera& camera;
  Pose<frame::C, frame::R> T_c_r;
  double boresight;
  std::vector<Point<frame::K>> body;

  Time now{};
  align::Prior said;                   // by navigation, of this frame
  Mat6 nav_covariance_r{Mat6::Zero()}; // of the same, receiver axes
  align::Prior nav;                    // of it what is believed
  align::NavStep nav_step;
  NavWatch watch;
  double said_off{0};                  // squared distance of navigation from the pose, in the last frame with both
  align::Prior between;                // nav, or an earlier update carried on
  align::Anchor anchor;
  align::PoseTrack track;
  align::CommonError common;
  align::Acquirer acquirer;
  std::optional<align::Acquired> acquired;  // in this frame: to be proven by the next
  View by_nav, by_track, by_search;    // of this frame
  bool corners_agreed{false};          // at some time, last then
  Time t_corners{};
  bool corrected{false};               // that pose is some pixels from where the track was: it was wrong
  const View* used{nullptr};           // the one whose reading was refined
  std::vector<align::Reading> readings;
  struct Residual {
    std::uint16_t feature;
    double square_px2;
  };
  std::vector<Residual> residuals;     // of the last refinement
  std::vector<Vec2> supporters;        // corners that the last refinement used, each once: far away, one serves many features
  const EdgeSet* edges{nullptr};       // taken part in the refinement, or null
  std::vector<double> scatter_frames;  // by feature: how many residuals its scatter holds
  std::vector<double> scatter;         // by feature: variance of its corner about the aligned place, px^2 an axis

  [[nodiscard]] align::Prior prior_from(const RelativeState& state) const;
  void take_navigation(const RelativeState& state);
  [[nodiscard]] align::Prior believed() const;
  /// A lead for the pose that features have just agreed on. Where navigation says that it cannot be, the lead is navigation's: a
  /// pattern that repeats agrees with both.
  [[nodiscard]] double track_bonus() const;
  [[nodiscard]] bool likely(const align::Acquired& found, const align::Prior& prior) const;
  [[nodiscard]] bool agreed(const Alignment& a, const View& view) const;
  [[nodiscard]] bool wide(const align::Prior& prior) const { return prior.valid && track.spread_px(prior.T, prior.P) > config.acquire_from_px; }
  /// The prior that says best where the features are.
  [[nodiscard]] const align::Prior& sharpest() const { return track.prior().valid && (!nav.valid || wide(nav)) ? track.prior() : nav; }
  void acquire(const PredictionSet& predicted, const CornerSet& corners, Alignment& out);
  bool believe(const align::Acquired& found, const PredictionSet& predicted, const CornerSet& corners, Alignment& out);
  void doubt(const PredictionSet& predicted, const CornerSet& corners, Alignment& out);
  void look(const align::Prior& prior, const PredictionSet& predicted, const CornerSet& corners, View& view) const;
  void read(double clutter, View& view);
  void refine(const View& view, const align::Vec6& start, Alignment& out);
  /// What landmarks, their 1 sigma taken `loose` times, and `prior` say together.
  [[nodiscard]] align::Prior held(const LandmarkSet& landmarks, double loose, const align::Prior& prior) const;
  /// Moved aside as the landmarks are from where the pose puts them, in the mean.
  [[nodiscard]] align::CameraPose shifted(const align::CameraPose& pose, const LandmarkSet& landmarks) const;
  void count_agreeing(const LandmarkSet& landmarks, double sharp_px, Alignment& out) const;
  void add_edges(const align::CameraPose& pose, double slack_px, Mat6& H, align::Vec6& g) const;
  [[nodiscard]] double median_residual_px();
  void learn(const Alignment& out);
  void compare_with_navigation(Alignment& out) const;
  void place(const align::CameraPose& pose, const Mat6& P, double common_px, PredictionSet& predicted) const;
};

/// Share of the features in view that found a corner.
inline double support(const Alignment& a) { return static_cast<double>(a.inliers) / std::max(1.0, static_cast<double>(a.considered)); }

}  // namespace cyclops
