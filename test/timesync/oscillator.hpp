#pragma once
/// A free-running quartz clock: a rate that wanders, and the white noise of its frequency, by a seed.
#include <algorithm>
#include <cmath>

#include "base/time.hpp"
#include "test/support.hpp"

namespace cyclops::test {

struct OscillatorSetup {
  double rate_ppm{50};              ///< at the beginning
  double wander_ppm_per_rs{0.03};   ///< random walk of the rate
  double swing_ppm{0.3};            ///< temperature: a slow sine on top ...
  double swing_s{600};              ///< ... of this period
  double jitter_ns_per_rs{5};
};

/// What the clock has gained on true time, in ns. Ask in order of time.
class Oscillator {
 public:
  Oscillator(const OscillatorSetup& setup, Random& random) : s_(setup), random_(random), rate_ppm_(setup.rate_ppm), phase_(6.28 * std::uniform_real_distribution<double>(0, 1)(random)) {}
  double gained_ns(double t_s) {
    while (t_s > t_s_) {
      const double dt = std::min(t_s - t_s_, 0.1);
      const double middle = s_.swing_ppm * std::sin(6.283185307 * (t_s_ + dt / 2) / s_.swing_s + phase_);
      gained_ns_ += (rate_ppm_ + middle) * 1e3 * dt + s_.jitter_ns_per_rs * std::sqrt(dt) * normal_(random_);
      rate_ppm_ += s_.wander_ppm_per_rs * std::sqrt(dt) * normal_(random_);
      t_s_ = dt < 0.1 ? t_s : t_s_ + dt;
    }
    return gained_ns_;
  }

 private:
  OscillatorSetup s_;
  Random& random_;
  std::normal_distribution<double> normal_{0, 1};
  double rate_ppm_, phase_;
  double t_s_{0}, gained_ns_{0};
};

}  // namespace cyclops::test
