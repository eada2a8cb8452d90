#pragma once
/// Is this the same picture as the one before, bit for bit? A sensor has noise, so two exposures never give that: a camera that
/// sends it repeats a buffer, and what it shows is not of the time it says.
///
/// Rows spread over the picture are compared, some 1.5 % of it. Threads  one. Memory: the rows, on the first call.
#include <cstdint>
#include <vector>

#include "msg/frame.hpp"

namespace cyclops {

class FrozenPicture {
 public:
  /// How many times in a row the picture has been the same; 0: it is new. Give complete pictures only.
  int repeats(const ImageView& picture);

 private:
  static constexpr int kRows = 16;
  std::vector<std::uint8_t> rows_;
  int repeats_{0};
};

}  // namespace cyclops
