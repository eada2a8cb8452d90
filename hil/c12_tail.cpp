// Fin, rudder, the fairing on top of it and what the fin carries.
#include <cmath>
#include <numbers>

#include "hil/c12_shape.hpp"

namespace cyclops::hil::c12 {
namespace {

using Ring = MeshBuilder::Ring;

/// An upright surface on the plane of symmetry: straight edges between two levels.
struct Upright {
  double z0, le0, te0, z1, le1, te1, half;
  [[nodiscard]] double share(double z) const { return (z - z0) / (z1 - z0); }
  [[nodiscard]] double leading(double z) const { return le0 + share(z) * (le1 - le0); }
  [[nodiscard]] double trailing(double z) const { return te0 + share(z) * (te1 - te0); }
  [[nodiscard]] double half_at(double s, double z) const {
    constexpr double at[] = {0, 0.02, 0.08, 0.2, 0.38, 0.66, 1}, thick[] = {0, 0.36, 0.68, 0.92, 1, 0.72, 0};
    std::size_t i = 0;
    while (i < 5 && at[i + 1] < s) ++i;
    return half * (1 - 0.3 * share(z)) * (thick[i] + (thick[i + 1] - thick[i]) * (s - at[i]) / (at[i + 1] - at[i]));
  }
  [[nodiscard]] Vec3 at(double s, double z, double side) const { return {leading(z) + s * (trailing(z) - leading(z)), side * half_at(s, z), z}; }
};

/// Material `gap` on the cell aft of chord fraction `hinge`.
void add_upright(MeshBuilder& out, const Upright& u, const std::vector<double>& zs, double hinge, std::uint16_t m, std::uint16_t gap) {
  const double width = 0.8 / (u.te0 - u.le0);
  const std::vector<double> shares{0, 0.02, 0.08, 0.2, 0.38, hinge, hinge + width, 1};
  std::vector<Ring> rings;
  for (double z : zs) {
    Ring ring;
    for (double s : shares) ring.push_back(u.at(s, z, 1));
    for (std::size_t k = shares.size() - 1; k-- > 1;) ring.push_back(u.at(shares[k], z, -1));
    rings.push_back(ring);
  }
  const std::size_t n = rings.front().size();
  out.loft(rings, [&](std::size_t, std::size_t j) { return j == 5 || n - 1 - j == 5 ? gap : m; }, m);
}

/// Body of revolution between two tips on the plane of symmetry.
void add_bullet(MeshBuilder& out, const Paint& paint, const Vec3& fore, const Vec3& aft) {
  // Its after part is a long cone: seen from behind and below the tip must stand clear of the rings before it.
  // One paint: a band a few pixels before the tip makes corners stronger than the tip's, and a detector then finds those.
  const double share[] = {0, 0.015, 0.05, 0.12, 0.25, 0.42, 0.58, 0.72, 0.83, 0.90, 0.965, 1}, radius[] = {0, 1.2, 2.5, 3.8, 4.9, 5.1, 4.6, 3.7, 2.7, 1.8, 0.62, 0};
  std::vector<Ring> rings;
  for (std::size_t i = 0; i < std::size(share); ++i) {
    Ring ring;
    for (int k = 0; k < 24; ++k) {
      const double a = 2 * std::numbers::pi * k / 24;
      ring.push_back(i == 0 ? fore : i + 1 == std::size(share) ? aft : Vec3(fore + share[i] * (aft - fore) + radius[i] * Vec3(0, std::cos(a), std::sin(a))));
    }
    rings.push_back(ring);
  }
  out.loft(rings, paint.white);
}

/// A made-up registration: upright and level strokes on both sides of the fin.
void add_registration(MeshBuilder& out, const Paint& paint, const Upright& fin) {
  constexpr double kTall = 9, kWide = 5.2, kStroke = 1.3, kLow = 160;
  // Strokes of a seven-part figure: top, upper left, upper right, middle, lower left, lower right, bottom.
  constexpr const char* kFigures[] = {"0010010", "1011101", "1111011"};
  double x = 452;
  for (const char* figure : kFigures) {
    const double bars[7][4] = {{0, kTall - kStroke, kWide, kTall}, {0, kTall / 2, kStroke, kTall}, {kWide - kStroke, kTall / 2, kWide, kTall}, {0, kTall / 2 - kStroke / 2, kWide, kTall / 2 + kStroke / 2},
                               {0, 0, kStroke, kTall / 2}, {kWide - kStroke, 0, kWide, kTall / 2}, {0, 0, kWide, kStroke}};
    for (int k = 0; k < 7; ++k) {
      if (figure[k] == '0') continue;
      const double* b = bars[k];
      const double z = kLow + 0.5 * (b[1] + b[3]), s = (x + 0.5 * (b[0] + b[2]) - fin.leading(z)) / (fin.trailing(z) - fin.leading(z));
      const double half = fin.half_at(s, z) + 0.25;
      out.box({x + b[0], -half, kLow + b[1]}, {x + b[2], half, kLow + b[3]}, paint.grey);
    }
    x += kWide + 2.2;
  }
}

}  // namespace

void add_fin(MeshBuilder& out, const Paint& paint, const Points& f) {
  const Upright fin{125, 393, 519, 207, 463, 515, 3.6};
  add_upright(out, fin, {125, 134, 143, 160, 180, 195, 207}, 0.66, paint.white, paint.gap);
  add_upright(out, {138, 330, 450, 164, 424, 450, 2.0}, {138, 148, 158, 164}, 0.66, paint.white, paint.white);        // dorsal fillet
  add_upright(out, {92, 462, 500, 114, 418, 497, 1.3}, {92, 98, 106, 114}, 0.66, paint.white, paint.white);           // ventral fin
  add_registration(out, paint, fin);
  add_bullet(out, paint, f.at(6), f.at(2));
  out.loft({{{478, -1.6, 215}, {486, -1.6, 215}, {486, 1.6, 215}, {478, 1.6, 215}}, {{480, -1, 221}, {484.5, -1, 221}, {484.5, 1, 221}, {480, 1, 221}}}, paint.lamp);  // beacon
  for (int id : {5, 12}) {  // VOR blades: level plates, one edge all round
    const Vec3 p = f.at(id);
    const double s = p.y() > 0 ? 1 : -1;
    out.lens({p, p + Vec3(-13, 0, 0), p + Vec3(-15, -s * 14.2, 0), p + Vec3(1, -s * 14.2, 0)}, {0, 0, 0.5}, paint.small);
  }
  const Vec3 light = f.at(14);  // lamp of the tail cone; the lowest corner of its after face is the feature
  const Ring rim{light, light + Vec3(0, 2.4, 2.6), light + Vec3(0, 2.1, 5.4), light + Vec3(0, 0, 6.8), light + Vec3(0, -2.1, 5.4), light + Vec3(0, -2.4, 2.6)};
  Ring inner;
  for (const Vec3& p : rim) inner.push_back(p + Vec3(-9, 0, 0));
  out.loft({inner, rim}, [&](auto, auto) { return paint.grey; }, paint.lamp);
}

}  // namespace cyclops::hil::c12
