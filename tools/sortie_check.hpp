#pragma once
/// What a sortie's folder holds, and exactly what is missing in it.
#include <string>
#include <vector>

#include "base/result.hpp"
#include "record/scan.hpp"
#include "record/sortie.hpp"

namespace cyclops::tools {

/// One log with its parts, read as one.
struct LogReport {
  std::string name;
  std::vector<record::LogScan> parts;
  std::int64_t events{0};
  std::int64_t lost_events{0};               ///< numbers left out: refused by a full buffer or a disk, or cut away
  [[nodiscard]] std::int64_t bytes() const;
  [[nodiscard]] double seconds() const;      ///< first to last event
};

struct SortieReport {
  bool sortie{false};                        ///< has sortie.toml: was recorded, so seals and published.lcm are expected
  bool finished{false};                      ///< has its manifest
  record::SortieHead head;
  LogReport inputs, published, frames;
  std::int64_t frames_used{0};               ///< FRAME messages: what the chain was given
  std::int64_t frames_there{0};              ///< with pixels, undamaged
  std::vector<record::Range> without_pixels; ///< their numbers
  std::vector<record::Range> damaged_frames; ///< numbers of frames whose checksum is wrong
  std::vector<std::string> problems;         ///< what is missing or wrong in the record, one a line
  std::vector<std::string> notes;            ///< what the camera or the links had lost before
};

/// Reads every byte. Errors: no folder, or neither manifest nor sortie.toml in it.
Result<SortieReport> check_sortie(const std::string& folder);
/// For people: sizes, rates, times.
void print_info(const SortieReport& report);
/// "3 to 5, 9"; at most eight ranges.
[[nodiscard]] std::string text_of(const std::vector<record::Range>& ranges);

}  // namespace cyclops::tools
