#pragma once
/// Plain histogram equalisation of one part of the image as a table: level[value]. Spec 2.4 step 7, for twilight: it raises
/// contrast and with it noise and false corners, so take a larger segment buffer and expect more candidates.
///
/// Level of a value = share of the part's pixels at or below it, less the share of the darkest value, stretched over all
/// codes of the format. A part of one value only stays as it is. Cost grows with the number of codes (65536 for mono16).
/// Memory: two tables, allocated on construction. Threads: one at a time.
#include <cstdint>
#include <vector>

#include "detect/corner_kernel.hpp"

namespace cyclops {

class Equaliser {
 public:
  Equaliser() : count_(65536), level_(65536) {}
  /// Valid until the next call. `part` lies inside the image; missing rows do not count.
  const std::uint16_t* levels(const ImageView& image, const PixelRect& part, const RowMask* missing);

 private:
  std::vector<std::uint32_t> count_;
  std::vector<std::uint16_t> level_;
};

}  // namespace cyclops
