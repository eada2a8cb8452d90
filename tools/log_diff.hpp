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

/// Frames are paired by mid-exposure time, payloads compared byte by byte in the order of the stages:
/// NAV, PREDICTION, SUBIMAGE, CORNER, TRACK, MEASUREMENT.
Result<LogDiff> diff_logs(const std::string& a, const std::string& b);

}  // namespace cyclops::tools
