#include "capture/frozen_picture.hpp"

#include <algorithm>
#include <cstring>

namespace cyclops {

int FrozenPicture::repeats(const ImageView& picture) {
  const int rows = std::min(kRows, picture.height);
  const auto row = static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(bytes_per_pixel(picture.format));
  bool same = rows_.size() == row * static_cast<std::size_t>(rows);
  if (!same) rows_.assign(row * static_cast<std::size_t>(rows), 0);
  for (int i = 0; i < rows; ++i) {
    const std::uint8_t* now = picture.row8((2 * i + 1) * picture.height / (2 * rows));
    std::uint8_t* before = &rows_[row * static_cast<std::size_t>(i)];
    same = same && std::memcmp(before, now, row) == 0;
    if (!same) std::memcpy(before, now, row);
  }
  return repeats_ = same ? repeats_ + 1 : 0;
}

}  // namespace cyclops
