#pragma once
/// How far the features have moved since they were last agreed on, from the pictures alone: for motions that nothing has predicted, where
/// corners do not agree about the expected pose.
///
/// Learn    after a frame whose pose is known: what surrounds each feature, in cells of some pixels, as far as it lies inside the outline
///          (convex hull) of the features. What is outside is background and need not move with them.
/// Find     normalised cross-correlation of each of them with the new picture, for all shifts up to kReach cells about the expected place.
///          Features move nearly alike: each map is widened by kGive cells (the best within), the mean of the maps has its peak at the motion
///          of the group, and each feature's own peak lies near it, to a fraction of a cell by a parabola.
/// Honest   nothing is given when another motion suits nearly as well (a pattern that repeats), or when few features agree.
/// Frames   raw pixels. Time: none. Threads: one at a time. Memory: everything on construction. Deterministic.
/// Source   block matching with a deformable group; parts that give as in Felzenszwalb & Huttenlocher 2005.
#include <array>
#include <vector>

#include "flow/flow_config.hpp"
#include "msg/chain.hpp"
#include "msg/frame.hpp"

namespace cyclops {

class FlowFinder {
 public:
  explicit FlowFinder(const FlowConfig& config);

  /// The picture of a frame, where its features are, and which of them were measured: what hides others is not theirs. What was not
  /// measured is remembered for kRemember calls.
  void learn(const ImageView& image, const RowMask* missing, const PredictionSet& aligned, const MeasurementSet& measured);
  /// Where the features of the last learn() are in this picture, looked for about `expected` (item i is feature i). Empty when the
  /// pictures do not say. Covariances are those of the place found against the place learnt.
  const LandmarkSet& find(const ImageView& image, const RowMask* missing, const PredictionSet& expected);
  /// After find: the same about places that are known better now, as features need not all move alike.
  const LandmarkSet& find_again(const PredictionSet& expected);
  /// So far from the motion of the group a feature is looked for.
  [[nodiscard]] double give_px() const { return static_cast<double>(kGive * cell_px_); }

 private:
  static constexpr int kHalf = 4, kSide = 2 * kHalf + 1, kReach = 13, kShifts = 2 * kReach + 1, kGive = 2;
  static constexpr int kMost = 160;              // cells along a side of the field
  static constexpr std::size_t kParts = 24;
  static constexpr int kRemember = 5;
  using Map = std::array<float, kShifts * kShifts>;  // by shift
  struct Part {
    std::uint16_t feature{0};
    int age{0};                                  // learn() calls since it was cut
    Vec2 inside_px{0, 0};                        // place of the feature from the centre of the middle cell
    std::array<float, kSide * kSide> cell{};     // mean removed, 0 outside the outline
    std::array<float, kSide * kSide> inside{};   // 1 inside the outline
    float norm{0};
    float count{0};
    bool sought{false};                          // in this frame: its place is expected in the image
    int u{0}, v{0};                              // then: middle cell at that place, in the field
    Map map{};                                   // correlation
  };

  void outline();
  [[nodiscard]] bool in_outline(const Vec2& uv_px) const;
  void forget();
  [[nodiscard]] Part* part_of(std::uint16_t feature);
  bool cut(const ImageView& image, const RowMask* missing, const Prediction& p, Part& part) const;
  bool read_field(const ImageView& image, const RowMask* missing, const PredictionSet& expected);
  void correlate(Part& part) const;
  static void widen(const Map& map, Map& out);
  [[nodiscard]] bool group(int& u, int& v);
  void place(const Part& part, int u, int v);
  [[nodiscard]] Vec2 middle_cell(const Part& part, const Prediction& expected) const;
  const LandmarkSet& enough();

  FlowConfig config_;
  int cell_px_{2};
  StaticVector<std::uint16_t, kMaxFeatures> seen_{};
  StaticVector<Vec2, kMaxFeatures> points_{}, hull_{};
  StaticVector<Part, kParts> parts_{};
  Part fresh_{};
  std::vector<float> field_;                     // cells of the new picture
  int field_u0_{0}, field_v0_{0}, field_width_{0}, field_height_{0};
  Map sum_{}, wide_{};
  LandmarkSet found_{};
};

}  // namespace cyclops
