#pragma once
/// What is recorded, and where.
#include <cstdint>
#include <string>

namespace cyclops {

struct RecordOptions {
  std::string folder;                    ///< that gets the sortie's folder; empty: nothing is recorded
  std::string name;                      ///< of the sortie's folder; empty: UTC as 20261122T070400Z
  double limit_mbps{0};                  ///< MB/s of pixels at most, to leave the disk to others; 0: no limit
  std::int64_t reserve_bytes{std::int64_t{256} << 20};  ///< of free disk that pixels must leave
  std::int64_t split_bytes{std::int64_t{4} << 30};
  double split_s{1800};
};

}  // namespace cyclops
