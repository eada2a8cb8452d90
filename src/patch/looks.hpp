#pragma once
/// How features of the tanker look, learnt from earlier flights: small pictures whose pose, feature and worth are known.
///
/// File     text, one look a line, fields between commas, as cyclops-learn writes it beside the model (docs/learning.md). First line "cyclops-looks-1",
///          second the names of the columns:
///            id x y z                 feature, and its place in tanker body axes, m: must be the model's
///            light                    where the picture is from: letters, digits, - _ .
///            qw qx qy qz tx ty tz     T_c_k when it was taken: unit quaternion, m
///            right_u right_v down_u down_v   what a metre to the right and one down across the line of sight are there, px
///            u v                      the feature, from the middle of the picture, px
///            tried matched            views it was looked for in, and found
///            scatter anchor           1 sigma an axis, px: of one match about the feature, and of u v itself
///            correlation              mean over its matches
///            pixels                   37 rows of 37, two hexadecimal digits each; black and white level are free
/// Errors   file:line, column, value, what was expected. Every character is part of a value that is checked.
/// Threads  plain data.
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/tanker_model.hpp"
#include "patch/stored_patch.hpp"

namespace cyclops {

struct Look {
  std::int32_t id{0};
  std::size_t feature{0};        ///< index into the model
  Point<frame::K> p_k{};
  std::string light;
  StoredPatch patch{};           ///< brightness 0 .. 255
  int tried{0}, matched{0};
  double scatter_px{0}, anchor_px{0};
  double correlation{0};
};

struct Looks {
  static constexpr std::size_t kMostOfFeature = 64;
  std::vector<Look> items;

  static Result<Looks> parse(const std::string& text, const std::string& name, const TankerModel& model);
  static Result<Looks> load(const std::string& path, const TankerModel& model);
  [[nodiscard]] std::string text() const;
};

}  // namespace cyclops
