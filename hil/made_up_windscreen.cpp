#include "hil/made_up_windscreen.hpp"

#include <cmath>

#include "hil/noise.hpp"

namespace cyclops::hil {

Result<Windscreen> made_up_windscreen(int width_px, int height_px, double size) {
  if (size == 0) return Windscreen();
  constexpr int kStep = 16;
  const int rows = height_px / kStep + 2, columns = width_px / kStep + 2;
  std::vector<float> du, dv;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double u = 2.0 * kStep * j / width_px - 1, v = 2.0 * kStep * i / height_px - 1;
      du.push_back(static_cast<float>(size * (0.5 + 1.7 * u * u * u + u * v * v - 0.8 * u * v + 0.45 * std::sin(2.1 * v + 0.7))));
      dv.push_back(static_cast<float>(size * (-0.4 + 1.4 * v * v * v + 0.8 * v * u * u + 0.9 * u * u + 0.4 * std::sin(1.9 * u + 1.3))));
    }
  return Windscreen::from_grids(rows, columns, kStep, std::move(du), std::move(dv));
}

Result<Windscreen> calibrated_windscreen(const Windscreen& exact, int width_px, int height_px, const Calibration& how) {
  const int rows = height_px / how.step_px + 2, columns = width_px / how.step_px + 2;
  std::vector<float> du, dv;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const Vec2 at(j * how.step_px, i * how.step_px);
      const Vec2 shift = exact.delta(at) - how.focal_px / how.range_m * windscreen_parallax_m(at, width_px, height_px, how.parallax_mm);
      const auto place = static_cast<std::uint64_t>(i * columns + j);
      du.push_back(static_cast<float>(shift.x() + how.sigma_px * normal(key(how.seed, place, 0))));
      dv.push_back(static_cast<float>(shift.y() + how.sigma_px * normal(key(how.seed, place, 1))));
    }
  return Windscreen::from_grids(rows, columns, how.step_px, std::move(du), std::move(dv));
}

Vec2 windscreen_parallax_m(const Vec2& raw_px, int width_px, int height_px, double parallax_mm) {
  const double x = 2 * (raw_px.x() + 0.5) / width_px - 1, y = 2 * (raw_px.y() + 0.5) / height_px - 1;
  return 0.5e-3 * parallax_mm * (x * x + y * y) * Vec2(x, y);
}

}  // namespace cyclops::hil
