#include "capture/frozen_picture.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

TEST(FrozenPicture, CountsHowOftenAPictureComesAgainAndStartsAfreshWithANewOne) {
  std::vector<std::uint8_t> pixels(64 * 48 * 2, 7);
  const ImageView view{pixels.data(), 64, 48, 128, PixelFormat::kMono12};
  FrozenPicture pictures;
  EXPECT_EQ(pictures.repeats(view), 0);
  EXPECT_EQ(pictures.repeats(view), 1);
  EXPECT_EQ(pictures.repeats(view), 2);
  for (std::size_t i = 0; i < pixels.size(); i += 100) pixels[i] ^= 1;  // noise
  EXPECT_EQ(pictures.repeats(view), 0);
  EXPECT_EQ(pictures.repeats(view), 1);
}

TEST(FrozenPicture, TakesPicturesOfAnySizeAndFormat) {
  FrozenPicture pictures;
  std::vector<std::uint8_t> pixels(16 * 16, 1);
  EXPECT_EQ(pictures.repeats({pixels.data(), 16, 16, 16, PixelFormat::kMono8}), 0);
  EXPECT_EQ(pictures.repeats({pixels.data(), 4, 3, 4, PixelFormat::kMono8}), 0);
  EXPECT_EQ(pictures.repeats({pixels.data(), 4, 3, 4, PixelFormat::kMono8}), 1);
  EXPECT_EQ(pictures.repeats({pixels.data(), 16, 16, 16, PixelFormat::kMono8}), 0);
}

}  // namespace
}  // namespace cyclops
