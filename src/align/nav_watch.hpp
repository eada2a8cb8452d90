#pragma once
/// Does navigation contradict the picture? One frame may; a second of frames that nearly all do is a wrong input: a step in a position,
/// a wrong attitude, a frozen or foreign data link.
///
/// Test     squared Mahalanobis distance of navigation from the aligned pose, 6 degrees of freedom, above `limit` in more than
///          `share` of the frames of the last `window` that had both. Over again at half the share.
/// Time     service clock of the frames. Threads: one at a time. Memory: fixed.
#include <array>
#include <cstddef>

#include "base/time.hpp"
#include "msg/chain.hpp"

namespace cyclops {

class NavWatch {
 public:
  static constexpr double kLimit = 27.9;  ///< 99.99 % of chi-square with 6 degrees of freedom
  static constexpr double kShare = 0.7;
  static constexpr std::size_t kLeast = 8;                              ///< frames that must have been compared
  static constexpr Duration kWindow = Duration::from_ms(700);

  /// `has_nav`: navigation was there for this frame. True while navigation is not to be believed.
  bool update(Time t, bool has_nav, const Alignment& alignment) {
    if (has_nav && alignment.consensus) push(t, alignment.nav_disagreement > kLimit);
    while (count_ > 0 && t - seen_[first_].t > kWindow) pop();
    if (count_ == 0) return suspect_ = false;
    const double share = static_cast<double>(wrong_) / static_cast<double>(count_);
    if (count_ >= kLeast && share > kShare) suspect_ = true;
    if (share < 0.5 * kShare) suspect_ = false;
    return suspect_;
  }
  [[nodiscard]] bool suspect() const { return suspect_; }

 private:
  static constexpr std::size_t kMost = 256;
  struct Seen {
    Time t{};
    bool wrong{false};
  };
  void pop() {
    wrong_ -= seen_[first_].wrong ? 1 : 0;
    first_ = (first_ + 1) % kMost;
    --count_;
  }
  void push(Time t, bool wrong) {
    if (count_ == kMost) pop();
    seen_[(first_ + count_) % kMost] = {t, wrong};
    wrong_ += wrong ? 1 : 0;
    ++count_;
  }
  std::array<Seen, kMost> seen_{};
  std::size_t first_{0}, count_{0}, wrong_{0};
  bool suspect_{false};
};

}  // namespace cyclops
