#pragma once
/// Do two logs of published messages say the same, bit for bit?
#include <cstdint>
#include <string>

#include "base/result.hpp"

namespace cyclops::tools {

struct LogDiff {
  std::int64_t frames_a{0}, frames_b{0};   ///< frames with measurements
  std::int64_t equal{0};                   ///< frames in which every stage says the same
  std::int64_t different{0};
  std::int64_t only_a{0}, only_b{0};
  std::int64_t first_frame_seq{-1};        ///< of the first difference
  std::string first_stage;                 ///< the earliest stage that differs there
  [[nodiscard]] bool same() const { return different == 0 && only_a == 0 && only_b == 0 && frames_a > 0; }
};

struct DiffOptions {
  bool by_seq{false};   ///< pair by number instead: for logs of the same inputs, where a frame without a time counts too
  std::int64_t before{0};  ///< only frames with a smaller seq; 0: all
  bool heard{false};    ///< the second was heard over a network and may lack messages: what it has must be the same
};

/// Frames are paired by mid-exposure time, payloads compared byte by byte in the order of the stages:
/// NAV, PREDICTION, SUBIMAGE, CORNER, TRACK, MEASUREMENT.
/// A name stands for all parts of a split log; a folder for what was published in that sortie.
Result<LogDiff> diff_logs(const std::string& a, const std::string& b, const DiffOptions& options = {});

}  // namespace cyclops::tools
