#pragma once
/// The corner measure of one rectangle and its local maxima, in one walk over the pixels. This is the hot path.
///
///   X = I * [-1 0 1], Y likewise down;  A = X^2 (*) w, B = Y^2 (*) w, C = XY (*) w;  Rc = (AB - C^2) / (A + B + eps)
///
/// The rectangle is cut into strips of kStrip columns. For each row of a strip: pixels become float, products X^2 Y^2 XY
/// go into a ring of as many rows as w is high, the ring is weighted down, then across, Noble's measure goes into a ring of
/// 2 r + 1 rows, and a row that has its r neighbours below is searched for maxima. All of it stays in the nearest cache.
///
/// Frames   raw pixels. Units: counts of the image; Rc in counts^2.
/// Memory   scratch inside, about 90 KiB; no heap. Threads: one at a time.
/// Source   spec 2.4. `reference_measure` is the same in plain scalar code; both give the same bits.
#include <array>
#include <cstdint>
#include <span>

#include "msg/frame.hpp"

namespace cyclops {

/// Half-open: columns u0..u1-1, rows v0..v1-1.
struct PixelRect {
  int u0{0}, v0{0}, u1{0}, v1{0};
  [[nodiscard]] bool empty() const { return u0 >= u1 || v0 >= v1; }
  [[nodiscard]] PixelRect grown(int by) const { return {u0 - by, v0 - by, u1 + by, v1 + by}; }
  [[nodiscard]] PixelRect within(const PixelRect& o) const {
    return {u0 > o.u0 ? u0 : o.u0, v0 > o.v0 ? v0 : o.v0, u1 < o.u1 ? u1 : o.u1, v1 < o.v1 ? v1 : o.v1};
  }
};

struct KernelConfig {
  static constexpr int kMaxHalf = 6;
  static constexpr int kMaxRadius = 7;
  int half{3};                                  ///< w is 2 half + 1 wide, 1..kMaxHalf
  int radius{3};                                ///< of the square in which a maximum is one, 1..kMaxRadius
  float eps{1e-6F};                             ///< counts^2
  std::array<float, kMaxHalf + 1> weight{};     ///< of w in one dimension: centre, then outwards; sums to 1
};
/// Sampled and normalised. Spec 2.4: 0.399050 0.242036 0.054006 0.004433 for sigma 1, size 7.
[[nodiscard]] KernelConfig kernel_config(double gaussian_sigma_px, int gaussian_size, int nms_radius_px, double eps);

struct KernelJob {
  ImageView image;
  PixelRect domain;                  ///< pixels outside do not exist; products there are zero
  bool zero_outside{false};          ///< pixels outside count as zero (thesis), else as the nearest pixel of the domain
  PixelRect measure;                 ///< where the measure is computed, within the domain
  PixelRect search;                  ///< where maxima are reported, within `measure`
  PixelRect mean;                    ///< where the measure is averaged, within `measure`
  const RowMask* missing{nullptr};   ///< products that touch a missing row are zero
  const std::uint16_t* level{nullptr};  ///< pixel value -> value to use instead, or null
};

struct Peak {
  float measure{0};
  std::uint16_t u{0};
  std::uint16_t v{0};
};

struct KernelResult {
  double sum{0};           ///< of the measure over `mean`, rows whose support misses a row left out
  std::int64_t pixels{0};  ///< that were summed
  std::size_t peaks{0};    ///< written
  std::size_t lost{0};     ///< found no room
  [[nodiscard]] double mean() const { return pixels > 0 ? sum / static_cast<double>(pixels) : 0; }
};

class CornerKernel {
 public:
  explicit CornerKernel(const KernelConfig& config);
  /// Every maximum of the measure in `search`, in raster order within each strip: larger than all that precede it in its
  /// square, no smaller than all that follow, so of a plateau the first pixel stays.
  /// `picture`: null, or room for the measure, `measure` wide and high.
  KernelResult run(const KernelJob& job, std::span<Peak> peaks, float* picture = nullptr);

  static constexpr int kStrip = 192;  ///< columns
  /// Rows are kept `kPad` floats in: room for the square to the left of the first column.
  static constexpr int kPad = 8;
  static constexpr int kRow = kStrip + 2 * KernelConfig::kMaxRadius + 2 * KernelConfig::kMaxHalf + 2 + 2 * kPad + 12;
  static_assert(kRow % 8 == 0);

 private:
  using Row = std::array<float, kRow>;
  using Triple = std::array<Row, 3>;  ///< X^2, Y^2, XY or their weighted sums
  /// Columns m0..m1-1 of the measure are computed, of which own0..own1-1 belong to no other strip.
  struct Strip {
    int own0, own1, m0, m1;
  };
  void run_strip(const KernelJob& job, const Strip& strip, std::span<Peak> peaks, float* picture, KernelResult& result);
  const float* pixels(const KernelJob& job, const Strip& strip, int v);
  void products(const KernelJob& job, const Strip& strip, int v);
  const float* measure(const KernelJob& job, const Strip& strip, int v);
  void search(const KernelJob& job, const Strip& strip, int v, std::span<Peak> peaks, KernelResult& result);

  KernelConfig config_;
  alignas(64) std::array<Row, 3> pixel_{};
  std::array<int, 3> pixel_row_{};  ///< which row of the image each holds
  alignas(64) std::array<Triple, 2 * KernelConfig::kMaxHalf + 1> product_{};
  alignas(64) Triple down_{};
  alignas(64) std::array<Row, 2 * KernelConfig::kMaxRadius + 1> measure_{};
  alignas(64) std::array<Row, 2 * KernelConfig::kMaxRadius + 1> before_{};  ///< largest of the r to the left
  alignas(64) std::array<Row, 2 * KernelConfig::kMaxRadius + 1> around_{};  ///< largest of the 2 r + 1 around
  alignas(64) Row lowest_{};
};

}  // namespace cyclops
