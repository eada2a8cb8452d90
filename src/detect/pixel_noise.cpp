#include "detect/pixel_noise.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace cyclops {
namespace {

constexpr double kRounding = 1.0 / 12;
constexpr int kBlock = 64;

/// Counts of whole numbers, eight bins an octave; exact below 16.
class Histogram {
 public:
  void add(float value) { ++bins_[value < 1 ? 0 : 1 + ((std::bit_cast<std::uint32_t>(value) - kOne) >> 20)]; }
  /// The whole number n stands for n - 1/2 .. n + 1/2.
  [[nodiscard]] double median() const {
    int total = 0, below = 0;
    for (int n : bins_) total += n;
    for (std::size_t b = 0; b < bins_.size(); ++b) {
      if (2 * (below + bins_[b]) >= total && bins_[b] > 0) {
        const double low = b == 0 ? 0 : start(b) - 0.5, high = start(b + 1) - 0.5;
        return low + (high - low) * (0.5 * total - below) / bins_[b];
      }
      below += bins_[b];
    }
    return 0;
  }

 private:
  static constexpr std::uint32_t kOne = std::bit_cast<std::uint32_t>(1.0F);
  /// The first whole number of a bin.
  static double start(std::size_t bin) {
    return std::ceil(static_cast<double>(std::bit_cast<float>(kOne + (static_cast<std::uint32_t>(bin - 1) << 20))));
  }
  std::array<int, 1 + 8 * 20> bins_{};
};

template <class Pixel>
void add_row(const Pixel* up, const Pixel* mid, const Pixel* down, int n, Histogram& out) {
  for (int begin = 0; begin < n; begin += kBlock) {
    const int count = std::min(kBlock, n - begin);
    float second[kBlock + 2];  // [1 -2 1] down each column, then along the row
    float answer[kBlock];
    for (int i = 0; i < count + 2; ++i) {
      const int c = begin + i;
      second[i] = static_cast<float>(static_cast<int>(up[c]) - 2 * static_cast<int>(mid[c]) + static_cast<int>(down[c]));
    }
    for (int i = 0; i < count; ++i) answer[i] = std::abs(second[i] - 2 * second[i + 1] + second[i + 2]);
    for (int i = 0; i < count; ++i) out.add(answer[i]);
  }
}

}  // namespace

double estimate_noise_variance(const ImageView& image, const PixelRect& part, const RowMask* missing) {
  constexpr int kEnough = 16384;
  const int width = part.u1 - part.u0, height = part.v1 - part.v0;
  if (width < 3 || height < 3) return kRounding;
  const int step = std::max(4, width * height / kEnough);
  Histogram histogram;
  for (int v = part.v0 + 1; v < part.v1 - 1; v += step) {
    if (missing != nullptr && (missing->missing(v - 1) || missing->missing(v) || missing->missing(v + 1))) continue;
    if (image.format == PixelFormat::kMono8)
      add_row(image.row8(v - 1) + part.u0, image.row8(v) + part.u0, image.row8(v + 1) + part.u0, width - 2, histogram);
    else
      add_row(image.row16(v - 1) + part.u0, image.row16(v) + part.u0, image.row16(v + 1) + part.u0, width - 2, histogram);
  }
  const double sigma = histogram.median() / (0.6744897501960817 * 6);
  return std::max(sigma * sigma, kRounding);
}

}  // namespace cyclops
