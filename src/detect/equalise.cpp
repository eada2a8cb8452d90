#include "detect/equalise.hpp"

#include <algorithm>

namespace cyclops {

const std::uint16_t* Equaliser::levels(const ImageView& image, const PixelRect& part, const RowMask* missing) {
  // Codes above the format's largest are possible in a damaged 16-bit frame, so every code has a place.
  const std::size_t codes = image.format == PixelFormat::kMono8 ? 256 : 65536;
  const double largest = (1 << bits_per_pixel(image.format)) - 1;
  std::fill(count_.begin(), count_.begin() + static_cast<std::ptrdiff_t>(codes), 0U);
  std::uint32_t total = 0;
  for (int v = part.v0; v < part.v1; ++v) {
    if (missing != nullptr && missing->missing(v)) continue;
    for (int u = part.u0; u < part.u1; ++u) ++count_[image.format == PixelFormat::kMono8 ? image.row8(v)[u] : image.row16(v)[u]];
    total += static_cast<std::uint32_t>(part.u1 - part.u0);
  }
  const auto darkest = std::find_if(count_.begin(), count_.end(), [](std::uint32_t n) { return n != 0; });
  const std::uint32_t floor = darkest == count_.end() ? 0 : *darkest;
  std::uint32_t below = 0;
  for (std::size_t value = 0; value < codes; ++value) {
    below += count_[value];
    const double share = total > floor ? (below - std::min(below, floor)) / static_cast<double>(total - floor) : 0;
    level_[value] = static_cast<std::uint16_t>(total > floor ? share * largest + 0.5 : static_cast<double>(value));
  }
  return level_.data();
}

}  // namespace cyclops
