#pragma once
/// Does what a track follows move as its feature should?
///
/// Each feature's place is expected from a pose in every frame: the one the group agreed on, or, where features stand alone, navigation's,
/// carried on between updates with its velocity and rates. What is measured less what is expected is constant for the feature
/// itself, whatever the pose's constant error. Something behind or before it slides away, and so does a place on an edge or in a cloud.
///
/// Test     over the last `window_s`, the slope of that difference, less the slope that the features have in common (their median: an error
///          of the pose is nobody's wrong motion), squared over its variance: chi-square, 2 degrees of freedom. The variance holds the
///          scatter about the line, at least the covariances', for as many independent frames as `correlation_s` leaves, and
///          `drift_px_s` for what a real feature slides as the view turns.
/// Course   a jump in the difference, or a gap, begins a new course: another corner, innocent until it has lasted `least_s`.
/// Outcome  a match that fails keeps its place in the course but not in the match set: kAgainstMotion.
/// Frames   raw pixels. Time: that of the corners. Threads: one at a time. Memory: all of it in the constructor.
/// Source   spec 5.2.3 / C9 (tracks against the common flow), [causey] 6.1: flow of a moving camera, by pose instead of focus of expansion.
#include <array>
#include <optional>
#include <vector>

#include "base/config.hpp"
#include "msg/chain.hpp"

namespace cyclops {

/// Keys motion_* of table "track".
struct MotionConfig {
  double window_s{0};           ///< 0: no such test
  double least_s{0.2};          ///< course needed for a verdict
  double chi_square{16};
  double sigma_px{0.3};         ///< 1 sigma an axis of what the covariances do not contain
  double correlation_s{0.1};    ///< errors closer in time than this are one
  double drift_px_s{1.0};       ///< 1 sigma an axis of what a feature may slide
  bool operator==(const MotionConfig&) const = default;
  void read(ConfigTable& table);
};

class MotionCheck {
 public:
  explicit MotionCheck(const MotionConfig& config);

  /// Once a frame, after association. `expected`: item i is feature i; null when nothing is known: all courses end.
  /// Matches that fail are taken out of `matches`. Returns how many.
  std::size_t step(Time t, const PredictionSet* expected, const TrackSet& tracks, const CornerSet& corners, MatchSet& matches);

 private:
  static constexpr std::size_t kMost = 48;     // frames of a course
  static constexpr double kGap_s = 0.2;
  static constexpr double kJump = 18.4;        // chi-square, 2 degrees of freedom, 99.99 %
  static constexpr std::size_t kGroup = 5;     // slopes from which on what they have in common is known
  struct Sample {
    Time t{};
    Vec2 off_px{0, 0};
    double variance_px2{0};
  };
  struct Course {
    std::array<Sample, kMost> sample{};
    std::size_t first{0}, count{0};
    [[nodiscard]] const Sample& at(std::size_t i) const { return sample[(first + i) % kMost]; }
    [[nodiscard]] const Sample& last() const { return at(count - 1); }
  };
  struct Slope {
    std::size_t track{0};
    Vec2 px_s{0, 0};
    double variance{0};                         // an axis
  };
  void add(Course& course, const Sample& sample) const;
  [[nodiscard]] std::optional<Slope> slope(const Course& course) const;
  [[nodiscard]] Vec2 common();

  MotionConfig config_;
  std::vector<Course> courses_;                 // by feature
  std::vector<Slope> slopes_;                   // of this frame
  std::vector<double> sorted_;
};

}  // namespace cyclops
