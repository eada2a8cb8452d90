#pragma once
/// The recent TSPI of one aircraft in order of time, whatever order it came in.
///
/// Order     a late sample is put where it belongs, as long as the history reaches back to it; so any permutation of the
///           same samples within the history ends in the same state. Of two samples with one time, or two neighbours with
///           one seq, the first to come stays.
/// Jumps     a sample more than max_jump_s from the newest is held back. Three in a row that agree with one another mean
///           that the stream's clock or the stream itself has moved: then they count. After a move back the old history
///           is dropped. A single wild time stamp therefore does nothing.
/// Time base service clock. Threads: one at a time. Memory: allocated on construction only.
#include <cstdint>
#include <optional>
#include <vector>

#include "base/static_vector.hpp"
#include "nav/motion.hpp"

namespace cyclops {

enum class Admission : std::uint8_t { kAccepted, kInsertedLate, kDuplicate, kTooOld, kHeldBack };

/// Since construction. `missing` - `out_of_order_inserted` is what really was lost.
struct TspiCounters {
  std::uint64_t accepted{0};               ///< in the history, late ones included
  std::uint64_t out_of_order_inserted{0};
  std::uint64_t duplicate{0};              ///< same time, or same seq as its neighbour in time
  std::uint64_t too_old{0};                ///< older than a full history
  std::uint64_t seq_gap{0};                ///< times that seq jumped ahead
  std::uint64_t missing{0};                ///< numbers jumped over
  std::uint64_t seq_restart{0};            ///< times that seq went back although time went on
  std::uint64_t held_back{0};              ///< further than max_jump_s from the newest
  std::uint64_t jump_forward{0};           ///< held-back samples that proved right
  std::uint64_t jump_back{0};              ///< the same into the past; the history was dropped
};

class TspiBuffer {
 public:
  static constexpr std::size_t kHistory = 512;
  explicit TspiBuffer(const NavConfig& config, std::size_t history = kHistory);

  Admission push(const Tspi& sample);
  void clear();

  /// Is there a sample at or after t?
  [[nodiscard]] bool covers(Time t) const { return size_ != 0 && newest().t >= t; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const Tspi& newest() const { return (*this)[size_ - 1]; }  ///< needs size() > 0
  [[nodiscard]] const Tspi& operator[](std::size_t i) const;               ///< oldest first
  [[nodiscard]] const TspiCounters& counters() const { return counters_; }

  enum class Kind : std::uint8_t { kInterpolated, kPredicted, kEmpty, kTooFar };
  struct Answer {
    Kind kind{Kind::kEmpty};
    Duration age{};          ///< t minus the newest sample used; with kTooFar minus the nearest
    AircraftState state{};   ///< only with kInterpolated and kPredicted
  };
  /// Between two samples at most max_gap_ms apart: interpolated. Else predicted from the nearest within max_age_ms.
  [[nodiscard]] Answer at(Time t) const;

 private:
  Tspi& item(std::size_t i) { return items_[(head_ + i) % items_.size()]; }
  [[nodiscard]] std::size_t first_at_or_after(Time t) const;
  [[nodiscard]] bool duplicate(const Tspi& sample, std::size_t i) const;
  Admission insert(const Tspi& sample);
  Admission hold_back(const Tspi& sample);
  void count_seq(const Tspi& sample);

  static constexpr std::size_t kProof = 3;
  NavConfig config_;
  std::vector<Tspi> items_;
  std::size_t head_{0};
  std::size_t size_{0};
  StaticVector<Tspi, kProof> held_{};
  TspiCounters counters_{};
};

}  // namespace cyclops
