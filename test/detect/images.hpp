#pragma once
/// Images for the detection tests: owned pixels, random noise, and anti-aliased corners whose place is known exactly.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "msg/frame.hpp"
#include "test/support.hpp"

namespace cyclops::test {

struct Image {
  int width{0}, height{0};
  PixelFormat format{PixelFormat::kMono8};
  std::vector<std::uint16_t> storage;  // 16-bit units so that rows of either kind are aligned

  Image(int w, int h, PixelFormat f) : width(w), height(h), format(f), storage(static_cast<std::size_t>(w * h)) {}
  [[nodiscard]] ImageView view() const {
    return {reinterpret_cast<const std::uint8_t*>(storage.data()), width, height, width * bytes_per_pixel(format), format};
  }
  void set(int u, int v, int value) {
    const auto i = static_cast<std::size_t>(v * width + u);
    if (format == PixelFormat::kMono8) reinterpret_cast<std::uint8_t*>(storage.data())[i] = static_cast<std::uint8_t>(value);
    else storage[i] = static_cast<std::uint16_t>(value);
  }
  [[nodiscard]] int get(int u, int v) const {
    const auto i = static_cast<std::size_t>(v * width + u);
    return format == PixelFormat::kMono8 ? reinterpret_cast<const std::uint8_t*>(storage.data())[i] : storage[i];
  }
  void fill(const std::function<int(int, int)>& f) {
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) set(u, v, f(u, v));
  }
  [[nodiscard]] int largest() const { return (1 << bits_per_pixel(format)) - 1; }
};

inline Image random_image(int w, int h, PixelFormat format, Random& random) {
  Image image(w, h, format);
  std::uniform_int_distribution<int> value(0, image.largest());
  image.fill([&](int, int) { return value(random); });
  return image;
}

/// The spec's 21x21 example: 100 for row >= 10 and column >= 10, else 0.
inline Image step_corner_21(PixelFormat format = PixelFormat::kMono8) {
  Image image(21, 21, format);
  image.fill([](int u, int v) { return u >= 10 && v >= 10 ? 100 : 0; });
  return image;
}

}  // namespace cyclops::test
