#pragma once
/// What the operating system says about this computer and this process, from /proc, /sys and getrusage.
///
/// Threads  one at a time; reads files, so never on the chain's thread. Errors: -1 for what cannot be had.
#include <cstdint>

namespace cyclops {

struct HostFacts {
  double load{-1};             ///< 1 min load average
  double temperature_c{-1};    ///< hottest thermal zone
  double cpu_percent{0};       ///< of this process since the call before, 100 = one core
  double memory_mb{-1};        ///< resident
  int open_files{-1};
};

class HostWatch {
 public:
  /// Looks at most once a second; in between what was seen last.
  const HostFacts& look(std::int64_t now_ns);

 private:
  HostFacts facts_{};
  std::int64_t last_ns_{0};
  double last_cpu_s_{0};
};

}  // namespace cyclops
