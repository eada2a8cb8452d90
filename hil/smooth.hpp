#pragma once
/// A smooth function of time, given by control values at a fixed rate: a uniform quintic B-spline, four times continuously
/// differentiable. Its derivatives are those of the function itself, exact to rounding: whoever differentiates values gets the
/// derivatives said here.
///
/// Time     s. Outside the control values the nearest stretch goes on.
/// Shape    follows the control values; ripples of period P are flattened by about (pi / (rate P))^2 of their size.
/// Threads  const use from any. Memory: the control values.
/// Source   cardinal B-splines of order 6, coefficients by expanding the box spline recursion (de Boor 1978).
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace cyclops::hil {

template <int N>
class Smooth {
 public:
  using Value = Eigen::Matrix<double, N, 1>;
  struct At { Value value, first, second; };  ///< the value and its derivatives per s and s^2

  Smooth() = default;
  /// `control[i]` belongs to time t0 + i / rate; at least six.
  Smooth(double t0_s, double rate_hz, std::vector<Value> control) : t0_(t0_s), rate_(rate_hz), control_(std::move(control)) {}

  [[nodiscard]] At at(double t_s) const {
    const double x = (t_s - t0_) * rate_;
    const auto last = static_cast<std::ptrdiff_t>(control_.size()) - 4;
    const auto i = std::clamp(static_cast<std::ptrdiff_t>(std::floor(x)), std::ptrdiff_t{2}, last);
    const double u = x - static_cast<double>(i);
    const Value* c = control_.data() + i - 2;
    // The polynomial of this stretch about the first control value, so that large values lose no digits.
    const Value d1 = c[1] - c[0], d2 = c[2] - c[0], d3 = c[3] - c[0], d4 = c[4] - c[0], d5 = c[5] - c[0];
    const Value a0 = (26 * d1 + 66 * d2 + 26 * d3 + d4) / 120, a1 = (-10 * d1 + 10 * d3 + d4) / 24, a2 = (2 * d1 - 6 * d2 + 2 * d3 + d4) / 12,
                a3 = (2 * d1 - 2 * d3 + d4) / 12, a4 = (-4 * d1 + 6 * d2 - 4 * d3 + d4) / 24, a5 = (5 * d1 - 10 * d2 + 10 * d3 - 5 * d4 + d5) / 120;
    At out;
    out.value = c[0] + a0 + u * (a1 + u * (a2 + u * (a3 + u * (a4 + u * a5))));
    out.first = rate_ * (a1 + u * (2 * a2 + u * (3 * a3 + u * (4 * a4 + u * 5 * a5))));
    out.second = rate_ * rate_ * (2 * a2 + u * (6 * a3 + u * (12 * a4 + u * 20 * a5)));
    return out;
  }
  [[nodiscard]] bool empty() const { return control_.size() < 6; }

 private:
  double t0_{0}, rate_{1};
  std::vector<Value> control_;
};

}  // namespace cyclops::hil
