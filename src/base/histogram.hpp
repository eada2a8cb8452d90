#pragma once
/// Distribution of durations in fixed memory: 32 bins an octave from 1 us to about 70 s, so a quantile is right to 2.2 %.
/// Threads: one writer; copy to read elsewhere.
#include <array>
#include <cmath>
#include <cstdint>

#include "base/time.hpp"

namespace cyclops {

class Histogram {
 public:
  void add(Duration d) {
    ++bins_[bin(d)];
    ++count_;
    if (d > max_) max_ = d;
    sum_ns_ += static_cast<double>(d.ns);
  }
  /// q in 0..1; zero when empty. The last quantile is the exact maximum.
  [[nodiscard]] Duration quantile(double q) const {
    if (count_ == 0) return {};
    const auto rank = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < kBins; ++i) {
      seen += bins_[i];
      if (seen >= rank && seen > 0) {
        const Duration centre{static_cast<std::int64_t>(1e3 * std::exp2((static_cast<double>(i) + 0.5) / kPerOctave))};
        return centre < max_ ? centre : max_;
      }
    }
    return max_;
  }
  [[nodiscard]] Duration max() const { return max_; }
  [[nodiscard]] Duration mean() const { return {count_ == 0 ? 0 : static_cast<std::int64_t>(sum_ns_ / static_cast<double>(count_))}; }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  void clear() { *this = Histogram{}; }

 private:
  static constexpr int kPerOctave = 32;
  static constexpr std::size_t kBins = 26 * kPerOctave;
  static std::size_t bin(Duration d) {
    const double octave = d.ns <= 1000 ? 0.0 : std::log2(static_cast<double>(d.ns) * 1e-3);
    const auto i = static_cast<std::size_t>(octave * kPerOctave);
    return i < kBins ? i : kBins - 1;
  }
  std::array<std::uint32_t, kBins> bins_{};
  std::uint64_t count_{0};
  Duration max_{};
  double sum_ns_{0};
};

/// Of the last one to two spans, never empty in between: turn() is called once a span.
class RecentHistogram {
 public:
  void add(Duration d) {
    older_.add(d);
    newer_.add(d);
  }
  void turn() {
    older_ = newer_;
    newer_.clear();
  }
  [[nodiscard]] Duration quantile(double q) const { return older_.quantile(q); }
  [[nodiscard]] Duration max() const { return older_.max(); }

 private:
  Histogram older_;
  Histogram newer_;
};

}  // namespace cyclops
