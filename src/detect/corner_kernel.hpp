#pragma once
/// The corner measure of one rectangle and its local maxima, in one walk over the pixels. This is the hot path.
///
///   X = I * [-1 0 1], Y likewise down;  A = X^2 (*) w, B = Y^2 (*) w, C = XY (*) w;  Rc = (AB - C^2) / (A + B + eps)
///
/// The rectangle is cut into strips of kStrip columns. For each row of a strip: pixels become float, products X^2 Y^2 XY
/// go into a ring of as many rows as w is high, the ring is weighted down, then across to Noble's measure, and a row that has
/// its r neighbours below is searched for maxima. All of it stays in the nearest cache.
/// Products come first down and then across, so that the rows of a small box pay for no more than their own height.
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
  static constexpr int kPad = 8;      ///< floats before the first column of a row of the measure: room for the square
  static constexpr int kRow = kStrip + 2 * (KernelConfig::kMaxRadius + KernelConfig::kMaxHalf + 1) + 4 * kPad - 4;

 private:
  using Row = std::array<float, kRow>;
  using Triple = std::array<Row, 3>;  ///< X^2, Y^2, XY or their weighted sums
  struct Measured {
    Row value;  ///< Rc, the lowest float where there is none
    Row run;    ///< largest of the r values from here on
  };
  /// Rows that are used again and again: each stands twice in the table, so that any n in a row are a window into it.
  template <int Max>
  class Ring {
   public:
    void reset(int n) { n_ = n, first_ = 0; }
    void set(int i, float* row) { row_[static_cast<std::size_t>(i)] = row_[static_cast<std::size_t>(i + n_)] = row; }
    float* renew() {  ///< the oldest row becomes the newest
      float* row = row_[static_cast<std::size_t>(first_)];
      first_ = first_ + 1 == n_ ? 0 : first_ + 1;
      return row;
    }
    [[nodiscard]] float* const* window() const { return row_.data() + first_; }  ///< oldest first
   private:
    std::array<float*, 2 * Max> row_{};
    int n_{Max}, first_{0};
  };
  /// The inner loops for this half width and radius; see corner_rows.hpp.
  struct Loops {
    void (*down)(const float* weight, const float* const* rows, int n, float* out);
    void (*across)(const float* weight, const float* in, float eps, int n, float* out);
    void (*run)(const float* value, int n, float* out);
    void (*around)(const float* value, const float* run, int n, float* const* rows, float* stack);
    int (*maxima)(const float* value, const float* run, const float* above, const float* below, int begin, int end, int* found);
  };
  /// Columns [begin, end) of a buffer lie in the domain, of n that are filled.
  struct Span {
    int first, n, begin, end;  ///< `first`: column of the image at index 0
  };
  struct Strip {
    int own0, own1;          ///< columns that belong to no other strip
    int m0, columns;         ///< columns m0..m0+columns-1 of the measure are computed
    Span pixels, products;
  };
  [[nodiscard]] Strip strip_at(const KernelJob& job, int u) const;
  void start(const Strip& strip);
  void run_strip(const KernelJob& job, const Strip& strip, std::span<Peak> peaks, float* picture, KernelResult& result);
  void load_pixels(const KernelJob& job, const Span& span, int v);
  void multiply(const KernelJob& job, const Span& span, int v);
  const float* measure(const Strip& strip);
  void measure_nothing(const Strip& strip);
  void search(const KernelJob& job, const Strip& strip, int v, std::span<Peak> peaks, KernelResult& result);

  static constexpr int kTaps = 2 * KernelConfig::kMaxHalf + 1;
  KernelConfig config_;
  Loops loops_;
  Ring<3> pixel_ring_;
  Ring<kTaps> product_ring_;
  // With row v the newest:
  Ring<KernelConfig::kMaxRadius + 1> measured_ring_;  ///< v - r .. v: Measured::value, its run kRow behind
  Ring<KernelConfig::kMaxRadius> around_ring_;        ///< v - r + 1 .. v: largest of the 2 r + 1 values around
  Ring<KernelConfig::kMaxRadius + 2> stack_ring_;     ///< v - r - 1 .. v: largest of the r values of `around` down to here
  alignas(64) std::array<Row, 3> pixel_{};
  alignas(64) std::array<Triple, kTaps> product_{};
  alignas(64) Triple down_{};
  alignas(64) std::array<Measured, KernelConfig::kMaxRadius + 1> measured_{};
  alignas(64) std::array<Row, KernelConfig::kMaxRadius> around_{};
  alignas(64) std::array<Row, KernelConfig::kMaxRadius + 2> stack_{};
  std::array<int, kStrip> hits_{};
};

}  // namespace cyclops
