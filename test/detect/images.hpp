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

/// A wedge: apex, direction of its axis and half its opening, rad.
struct Wedge {
  double u{0}, v{0};
  double axis{0};
  double half_opening{0.8};
};

/// Share of each pixel that a wedge covers, as a sensor of 100 % fill factor behind a lens of Gaussian blur sees it.
class WedgePainter {
 public:
  explicit WedgePainter(double blur_px) {
    const double reach = 0.5 + std::ceil(3 * blur_px * kPerPx) / kPerPx;
    const auto profile = [&](double t) {  // of the pixel's aperture, blurred
      if (blur_px <= 0) return std::abs(t) < 0.5 ? 1.0 : 0.0;
      const double s = blur_px * std::sqrt(2.0);
      return 0.5 * (std::erf((t + 0.5) / s) - std::erf((t - 0.5) / s));
    };
    double total = 0;
    for (double y = -reach + 0.5 / kPerPx; y < reach; y += 1.0 / kPerPx)
      for (double x = -reach + 0.5 / kPerPx; x < reach; x += 1.0 / kPerPx) {
        samples_.push_back({x, y, profile(x) * profile(y)});
        total += samples_.back().weight;
      }
    for (Sample& s : samples_) s.weight /= total;
  }
  [[nodiscard]] double share(const Wedge& w, int u, int v) const {
    const double a = w.axis - w.half_opening, b = w.axis + w.half_opening;
    double sum = 0;
    for (const Sample& s : samples_) {
      const double x = u + s.x - w.u, y = v + s.y - w.v;
      const bool left = y * std::cos(a) - x * std::sin(a) >= 0, right = x * std::sin(b) - y * std::cos(b) >= 0;
      if (w.half_opening > M_PI / 2 ? left || right : left && right) sum += s.weight;
    }
    return sum;
  }

 private:
  static constexpr int kPerPx = 8;
  struct Sample {
    double x, y, weight;
  };
  std::vector<Sample> samples_;
};

/// Sky of 1000 counts of 4096 with noise, and a wedge 1200 brighter at each apex, 18 px long.
inline Image sky_with_wedges(int side, const std::vector<Wedge>& wedges, double noise, Random& random,
                             PixelFormat format = PixelFormat::kMono12) {
  const WedgePainter painter(0.5);
  std::normal_distribution<double> gauss(0, noise);
  Image image(side, side, format);
  const double scale = (image.largest() + 1) / 4096.0;
  image.fill([&](int u, int v) {
    double value = 1000;
    for (const auto& w : wedges)
      if (std::hypot(u - w.u, v - w.v) < 18) value += 1200 * painter.share(w, u, v);
    return static_cast<int>(std::lround(std::clamp(scale * (value + gauss(random)), 0.0, 1.0 * image.largest())));
  });
  return image;
}

}  // namespace cyclops::test
