#pragma once
/// Inside align: where is the tanker when navigation is so wrong that its picture cannot be taken as shifted a little?
///
/// Method   Branch and bound over readings. One feature, another every frame, is bound to each corner that navigation's covariance
///          allows; each such pose is then led from feature to feature, the best known one first. A feature binds to one of the corners
///          in its gate or is taken as not found; the pose is conditioned and linearised anew each time, so that errors of a fifth of the
///          range and of several degrees do no harm. Of all readings at the same feature the `beam` most likely go on.
///          Score: sum of log( P_D N(innovation) / clutter density ) and log( 1 - P_D ). It is the interpretation tree of Grimson and
///          Lozano-Perez 1987 with the joint compatibility of Neira and Tardos 2001, kept narrow.
/// Cost     bounded: (features) x (beam) conditionings a frame.
/// Frames   as pose.hpp. Threads: one at a time. Memory: all on construction. Deterministic, no random numbers.
#include <bitset>
#include <optional>
#include <vector>

#include "align/align_config.hpp"
#include "align/pose.hpp"
#include "msg/chain.hpp"

namespace cyclops::align {

struct Acquired {
  Prior pose;          ///< with the covariance that is left
  double evidence{0};  ///< log-likelihood ratio against clutter alone
  double margin{0};    ///< over the best reading that is another pose; over clutter or the last reading kept, where none is
  int found{0};        ///< features bound to a corner
  int in_view{0};      ///< of those that can be seen, within the image
};

class Acquirer {
 public:
  /// All three must outlive this. `body`: the features, tanker body axes.
  Acquirer(const AlignConfig& config, const Camera& camera, const std::vector<Point<frame::K>>& body);

  /// `predicted` says which features can be seen. `variance_px2`: by feature, of its corner about it, an axis. `beam`: readings kept, at most
  /// the larger of those of the configuration.
  [[nodiscard]] std::optional<Acquired> search(const Prior& prior, const PredictionSet& predicted, const CornerSet& corners,
                                               const std::vector<double>& variance_px2, int beam);
  void reset() { turn_ = 0; }

 private:
  static constexpr std::size_t kMostCorners = 512;
  struct Node {
    CameraPose T{};
    Mat6 P{Mat6::Identity()};
    double evidence{0};
    int found{0};
    std::bitset<kMostCorners> used;
  };
  struct Child {
    double evidence;
    std::uint32_t parent;
    std::int32_t corner;  // -1: the feature was not found
  };
  struct Innovation {
    Mat2 S;
    Vec2 uv;
  };

  [[nodiscard]] std::optional<Innovation> innovation(const Node& node, std::uint16_t feature) const;
  void take_corners(const CornerSet& corners);
  void order_features(const Prior& prior, const PredictionSet& predicted);
  void branch(std::uint32_t parent, std::uint16_t feature);
  void keep_best(std::uint16_t feature, std::size_t beam);
  [[nodiscard]] bool bind(Node& node, std::uint16_t feature, const Vec2& corner) const;
  [[nodiscard]] std::optional<Acquired> best() const;
  [[nodiscard]] std::uint64_t where(const Node& node) const;
  [[nodiscard]] double separation_px(const Node& a, const Node& b) const;
  template <class Visit>
  void for_corners_near(const Vec2& uv, const Vec2& reach, Visit&& visit) const;

  const AlignConfig& config_;
  const Camera& camera_;
  const std::vector<Point<frame::K>>& body_;
  int columns_{0}, rows_{0};
  std::vector<std::uint32_t> cell_begin_;   // corners sorted by cell
  std::vector<Vec2> corners_;
  std::vector<std::pair<float, std::uint32_t>> strongest_;
  std::vector<std::uint16_t> order_;        // features in view, as they are asked
  std::vector<Node> nodes_, next_;
  std::vector<Child> children_;
  std::vector<std::uint64_t> places_;       // of the readings kept
  const double* variance_px2_{nullptr};     // by feature
  double log_clutter_{0};                   // log of corners a square pixel
  std::uint32_t turn_{0};                   // which feature begins
};

}  // namespace cyclops::align
