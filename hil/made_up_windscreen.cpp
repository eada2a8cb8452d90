#include "hil/made_up_windscreen.hpp"

#include <cmath>

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

}  // namespace cyclops::hil
