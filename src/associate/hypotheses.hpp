#pragma once
/// Several readings of the same frames, side by side, until the frames tell which one is right.
///
/// Reading  a place and covariance for each track and the log-likelihood of the frames under it. Where navigation has just replaced a
///          track, each reading goes on in two: with navigation's place, and with its own (spec 2.8: a bad update destroys a good
///          track). Own places of a group differ from navigation's by much the same shift, the error of the projection: one that strays
///          from the median shift, or has had no corner for long, is put at navigation's place plus that shift. Where corners compete, each of the k best assignments is a reading of its own. The `most` likeliest stay.
/// Score    sum of the gains of the frames (associate.hpp), older ones weighed less: e^(-dt / memory). Readings that give the same
///          corners to the same tracks are one.
/// Frames   raw pixels. Time: that of the corners; tracks are at the same time. Threads: one at a time. Memory: all of it in the constructor.
/// Source   track splitting and its pruning: Reid 1979; k best assignments instead of all: Cox & Hingorani 1996.
#include <span>
#include <vector>

#include "msg/chain.hpp"

namespace cyclops {

struct HypothesesConfig {
  std::size_t most{4};            ///< readings kept
  double memory_s{0.5};           ///< a frame this old counts 1/e
  double place_gain{0.7};         ///< share of an innovation taken into a reading's place
  double stray_px{6};             ///< from the median shift
  int most_misses{5};             ///< frames without a corner
};

class Hypotheses {
 public:
  Hypotheses(const HypothesesConfig& config, std::size_t max_tracks);

  /// Begins a frame: moves the readings to it. Returns how many there are to be judged, 2 * most at most.
  std::size_t begin(const TrackSet& tracks, Time t);
  /// What reading `i` of this frame expects: `tracks` with its own places. Holds until the next begin().
  void expected(std::size_t i, const TrackSet& tracks, TrackSet& out) const;
  /// Reading `i` with these corners (by track, -1: none) has this gain in this frame.
  void judge(std::size_t i, double gain, std::span<const std::int32_t> corners);
  /// Ends the frame: the likeliest stay. Corner of each track in the best one.
  std::span<const std::int32_t> settle(const CornerSet& corners);
  /// The reading that the best one came from, as `i` of expected().
  [[nodiscard]] std::size_t best() const { return slots_[now_[0]].parent; }
  /// Log-likelihood of the best reading less that of the next; large when it is alone.
  [[nodiscard]] double margin() const;
  [[nodiscard]] std::size_t size() const { return now_.size(); }

 private:
  struct Place {
    bool known{false};
    int misses{0};
    Vec2 uv_px{0, 0};
    Mat2 cov_px2{Mat2::Identity()};
  };
  struct Reading {
    double score{0};
    bool own{false};                    // goes on with its own places where navigation has replaced them
    std::size_t parent{0};              // judged from this one of this frame
    std::vector<Place> place;           // by track
    std::vector<std::int32_t> corner;   // by track, of the last frame
  };
  void move_on(Reading& r, const TrackSet& tracks, double dt) const;
  void gather_strays(Reading& r, const TrackSet& tracks);
  static void take(const Reading& from, Reading& to);
  void correct(Reading& r, const CornerSet& corners) const;

  HypothesesConfig config_;
  std::size_t max_tracks_;
  bool begun_{false};
  Time t_{};
  std::vector<Reading> slots_;
  std::vector<std::size_t> now_, next_; // slots, best first
  std::vector<std::size_t> judged_;     // slots of this frame, before association
  std::vector<std::size_t> free_;
  std::vector<double> shift_;
};

}  // namespace cyclops
