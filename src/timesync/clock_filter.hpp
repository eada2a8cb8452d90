#pragma once
/// One clock seen from the service clock: offset and rate with their covariance, from pairs of stamps of one event.
///
/// Model    service = other + offset; d(offset)/dt = rate. The rate wanders as a random walk (temperature, ageing), the
///          offset besides by white frequency noise. A pair adds white noise of the stamps, whose size is estimated from the
///          innovations, so that `sigma_at` is what was seen and not what was hoped for.
/// Method   Kalman filter with two states. An innovation beyond three sigma is given the weight that makes it three sigma
///          (Huber): a late interrupt hardly moves it, a real change still does after some pairs. Steps are the caller's to
///          find: it sees `surprise` and calls `forget_offset`.
/// Holdover without pairs the covariance is carried on: sigma grows as the wander allows, docs/time.md.
/// Time     `other` in ns of that clock, pairs in order. Only differences enter arithmetic: moving either clock by a constant
///          changes no bit.
/// Source   Brown & Hwang, Introduction to Random Signals and Applied Kalman Filtering, 3rd ed., ch. 10 (two-state clock).
/// Threads  one at a time. Memory: in place.
#include <cstdint>

#include "base/time.hpp"

namespace cyclops {

struct ClockNoise {
  double stamp_ns{50'000};         ///< scatter of a pair, 1 sigma, before any was seen
  double least_stamp_ns{100};      ///< it is never believed to be less: resolution of the stamps
  double unknown_rate{100e-6};     ///< 1 sigma of the rate before anything is known
  double largest_rate{200e-6};     ///< a rate beyond this is not believed
  double wander_per_rs{1e-7};      ///< 1 sigma the rate moves by in one second, growing with the root of time
  double jitter_ns_per_rs{10};     ///< 1 sigma of the offset from white frequency noise in one second
};

class ClockFilter {
 public:
  explicit ClockFilter(const ClockNoise& noise) : noise_(noise) { forget(); }
  void forget();          ///< another clock, or it was restarted
  void forget_offset();   ///< a step: the rate, a property of the two oscillators, is kept
  /// `scatter` is the sender's own 1 sigma of the pair; 0 leaves it to what is seen.
  void add(std::int64_t other_ns, Time service, Duration scatter = {});

  [[nodiscard]] bool valid() const { return pairs_ > 0; }
  [[nodiscard]] std::uint64_t pairs() const { return pairs_; }                       ///< since the offset was last forgotten
  // All below need valid().
  [[nodiscard]] Time at(std::int64_t other_ns) const;
  [[nodiscard]] Duration sigma_at(std::int64_t other_ns) const;                      ///< of `at` alone, without the scatter of a stamp
  [[nodiscard]] double surprise(std::int64_t other_ns, Time service) const;          ///< innovation over its sigma, with sign
  [[nodiscard]] Duration age_at(std::int64_t other_ns) const { return {other_ns - other_.ns}; }   ///< since the newest pair
  [[nodiscard]] std::int64_t newest_other() const { return other_.ns; }
  [[nodiscard]] Time newest_service() const { return service_; }
  [[nodiscard]] double offset_ns() const { return offset_ns_; }                      ///< estimate less the newest service stamp
  [[nodiscard]] double rate() const { return rate_; }                                ///< service clock against the other
  [[nodiscard]] double rate_sigma() const;
  [[nodiscard]] double stamp_sigma_ns() const;                                       ///< scatter of a pair as seen

 private:
  struct Covariance { double oo{0}, orr{0}, rr{0}; };   // offset ns, rate ns/s
  [[nodiscard]] Covariance carried(double dt_s) const;

  ClockNoise noise_;
  Duration other_{};          // newest pair
  Time service_{};
  double offset_ns_{0};
  double rate_{0};
  Covariance p_{};
  double stamp_ns2_{0};
  std::uint64_t pairs_{0};
  bool rate_seen_{false};     // the newest pair is of the same two oscillators
};

}  // namespace cyclops
