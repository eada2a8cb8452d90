#pragma once
/// Table "flow" of a profile.
#include "base/config.hpp"

namespace cyclops {

struct FlowConfig {
  bool enabled{true};
  double least_correlation{0.6};  ///< of the surroundings of one feature
  double least_margin{0.05};      ///< by which the motion that suits most has to be better than another, mean correlation

  /// `table` is [flow]; range errors are collected there.
  [[nodiscard]] static Result<FlowConfig> read(ConfigTable& table, FlowConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const FlowConfig&) const = default;
};

}  // namespace cyclops
