// Fuselage, nacelles and what hangs below the belly.
#include <cmath>
#include <numbers>

#include "hil/c12_shape.hpp"

namespace cyclops::hil::c12 {
namespace {

using Ring = MeshBuilder::Ring;
constexpr double kPi = std::numbers::pi;

/// A cross-section: |y/w|^n + |z/h|^n = 1 about its middle. n = 2 is an ellipse; fuselages are a little squarer.
struct Station {
  double x, half_width, bottom, top, exponent{2.25};
};

Vec3 on_station(const Station& s, double centre_y, double angle) {
  const auto power = [&](double c) { return std::copysign(std::pow(std::fabs(c), 2 / s.exponent), c); };
  return {s.x, centre_y + s.half_width * power(std::cos(angle)), 0.5 * (s.top + s.bottom) + 0.5 * (s.top - s.bottom) * power(std::sin(angle))};
}

Ring ring_of(const Station& s, double centre_y, int n) {
  Ring ring;
  for (int k = 0; k < n; ++k) ring.push_back(on_station(s, centre_y, 2 * kPi * k / n));
  return ring;
}

constexpr Station kFuselage[] = {
    {14.2, 0.3, 97.6, 98.4, 2}, {16, 3.2, 94, 102, 2},   {20, 6.6, 90.5, 106, 2}, {32, 12.5, 85.8, 112.5, 2}, {50, 18.2, 82.5, 118}, {75, 23.5, 80.4, 122.5}, {98, 26.8, 79.4, 128},
    {104, 27.3, 79.2, 132},     {122, 28.9, 78.9, 147.5}, {140, 29.5, 78.7, 150.2}, {170, 29.5, 78.7, 150.2},   {200, 29.5, 78.7, 150.2}, {230, 29.5, 78.7, 150.2},
    {260, 29.5, 78.7, 150.2},   {290, 29.45, 78.7, 150.1}, {311, 29.3, 78.72, 149.8}, {330, 28.4, 79.7, 149}, {352, 26.8, 82, 147.6}, {380, 23.9, 86.2, 145.2},
    {405, 20.5, 90.6, 142.6},   {430, 16.9, 95.4, 139.8}, {450, 13.8, 99.9, 137.2}, {470, 10.7, 104.6, 134.6}, {488, 7.9, 109.2, 132}, {500, 6, 112.8, 130.4}, {511, 4.2, 117, 128.6}};
constexpr int kAround = 64;

/// Flat disc that stands a quarter inch proud of a skin.
void add_disc(MeshBuilder& out, const Vec3& centre, const Vec3& outwards, double radius, double tall, std::uint16_t m) {
  const Vec3 n = outwards.normalized(), a = n.cross(Vec3::UnitX()).normalized(), b = a.cross(n);
  Ring ring;
  for (int k = 0; k < 14; ++k) ring.push_back(centre - 0.6 * n + radius * (tall * std::cos(2 * kPi * k / 14) * a + std::sin(2 * kPi * k / 14) * b));
  out.prism(ring, 0.85 * n, m, m);
}

Station fuselage_at(double x) {
  std::size_t i = 0;
  while (i + 2 < std::size(kFuselage) && kFuselage[i + 1].x < x) ++i;
  const Station &a = kFuselage[i], &b = kFuselage[i + 1];
  const double t = (x - a.x) / (b.x - a.x);
  return {x, a.half_width + t * (b.half_width - a.half_width), a.bottom + t * (b.bottom - a.bottom), a.top + t * (b.top - a.top), a.exponent};
}

/// The belly between the wings, wider than the fuselage: it fairs the roots in and ends behind the flaps.
void add_belly_fairing(MeshBuilder& out, const Paint& paint) {
  const Station stations[] = {{138, 16, 79.4, 92, 3}, {146, 25, 78.9, 97, 3.5}, {160, 30.2, 78.6, 101, 4}, {175, 31, 78.4, 103, 4}, {226, 31, 78.4, 103, 4},
                              {244, 30.8, 78.5, 101, 4}, {262, 29.4, 78.7, 98, 3.5}, {280, 26, 79.2, 94, 3}, {296, 18, 79.9, 88, 3}, {304, 8, 80.4, 84, 3}};
  std::vector<Ring> rings;
  for (const Station& s : stations) rings.push_back(ring_of(s, 0, 40));
  out.loft(rings, paint.white);
}

}  // namespace

void add_fuselage(MeshBuilder& out, const Paint& paint) {
  std::vector<Ring> rings;
  for (const Station& s : kFuselage) rings.push_back(ring_of(s, 0, kAround));
  out.loft(rings, [&](std::size_t i, std::size_t j) {
    const double x = 0.5 * (kFuselage[i].x + kFuselage[i + 1].x);
    const double around = std::fabs(static_cast<double>(j) + 0.5 - kAround / 4.0);  // cells from the crown
    if (x > 104 && x < 122 && around < 12 && around > 0.6) return paint.glass;
    if (x > 60 && around > 15 && around < 17) return paint.grey;                     // trim line
    return x > 60 && around > 17 && around < 18 ? paint.black : paint.white;
  }, paint.white);
  add_belly_fairing(out, paint);
  for (double side : {1.0, -1.0}) {
    out.side(side);
    for (double x : {152.0, 184.0, 216.0, 248.0, 280.0}) {
      const Vec3 p = on_station(fuselage_at(x), 0, 0.30);
      add_disc(out, p, {0, 1, 0.28}, 6.2, 1.15, paint.glass);
    }
    for (double x : {386.0, 391.0}) add_disc(out, on_station(fuselage_at(x), 0, -0.35), {0.13, 1, -0.4}, 0.7, 1, paint.small);  // static ports
  }
  out.side(1);
}

void add_nacelle(MeshBuilder& out, const Paint& paint, const Points& f) {
  const Vec3 corner = f.at(29);
  const double y = 103, zc = 92.2, radius = std::hypot(corner.y() - y, corner.z() - zc), theta = std::atan2(corner.z() - zc, corner.y() - y);  // below the horizon: negative
  const auto round = [](double x, double z, double w, double h) { return Station{x, w, z - h, z + h, 2}; };
  const Station stations[] = {round(120.5, 104, 10.5, 11), round(123, 103.7, 13.2, 13.8), round(130, 103, 15.4, 16.6), round(142, 101.8, 17, 18.6), round(156, 100.6, 17.8, 19.6),
                              round(172, 99.2, 17.9, 19.2), round(186, 97.9, 17.4, 18.2), round(202, 96.1, 16.2, 16.6), round(218, 94.2, 14.6, 14.8), round(corner.x(), zc, radius, radius),
                              round(246, 91, 10.2, 10.9), round(258, 90, 7.6, 9.2), round(269, 89.4, 4.9, 7.4), round(279, 89, 2.4, 5.6), round(286, 88.8, 0.6, 4.2)};
  constexpr int kOver = 22, kUnder = 14;
  std::vector<Ring> rings;
  for (const Station& s : stations) {
    Ring ring;
    for (int k = 0; k < kOver; ++k) ring.push_back(on_station(s, y, theta + (kPi - 2 * theta) * k / kOver));       // over the top, white
    for (int k = 0; k < kUnder; ++k) ring.push_back(on_station(s, y, kPi - theta + (kPi + 2 * theta) * k / kUnder));  // below
    if (s.x == corner.x()) ring[0] = corner;
    rings.push_back(ring);
  }
  out.loft(rings, [&](std::size_t i, std::size_t j) {
    const double x = stations[i].x;
    if (x < 123) return paint.metal;                                          // lip of the cowling
    if (j >= kOver && x >= 186 && x < corner.x()) return paint.black;         // panel stained by the exhaust
    const bool door = j == kOver + 3 || j == kOver + kUnder / 2 || j + 4 == kOver + kUnder;  // hinges and seam of the wheel-well doors
    return door && x >= 142 && x < 186 ? paint.grey : paint.white;
  }, paint.white);
  const Station spinner[] = {round(102.5, 104.75, 0.3, 0.3), round(104, 104.75, 2.6, 2.6), round(108, 104.75, 5.2, 5.2), round(113, 104.75, 7.2, 7.2), round(119, 104.75, 8.3, 8.3), round(120.8, 104.75, 8.3, 8.3)};
  std::vector<Ring> cone;
  for (const Station& s : spinner) cone.push_back(ring_of(s, y, 20));
  out.loft(cone, paint.metal);
  out.propeller({{116.5, y, 104.75}, -Vec3::UnitX(), 49.25, 8.3, 3, 8.5, 1700, 0.1F});
  // Two exhaust stacks; the lower outboard lip of the outboard one is the feature, the inboard one mirrors it.
  const Vec3 lip = f.at(21);
  constexpr double kPipe_in = 3.4, kAway = -0.993;  // direction of the lip from the pipe's middle
  const Vec3 centre = lip - kPipe_in * Vec3(0, std::cos(kAway), std::sin(kAway));
  for (double stack : {1.0, -1.0}) {
    std::vector<Ring> pipe;
    for (double t : {1.0, 0.55, 0.0}) {
      Ring ring;
      for (int k = 0; k < 12; ++k) {
        const Vec3 rim = k == 0 ? lip : centre + kPipe_in * Vec3(0, std::cos(kAway + k * kPi / 6), std::sin(kAway + k * kPi / 6));
        const Vec3 p = rim + Vec3(-22 * t, -8 * t * t, 1.5 * t);
        ring.emplace_back(p.x(), y + stack * (p.y() - y), p.z());
      }
      pipe.push_back(ring);
    }
    out.loft(pipe, [&](auto, auto) { return paint.metal; }, paint.gap);
  }
}

void add_belly(MeshBuilder& out, const Paint& paint, const Points& f) {
  const Vec3 black = f.at(31), guard = f.at(35), vhf = f.at(37), vent = f.at(38);
  out.prism({black, black + Vec3(-7, 0, 15.5), black + Vec3(9, 0, 15.5), black + Vec3(6, 0, 0.4)}, {0, -1.3, 0}, paint.small, paint.small);
  // Guard against stones: a wedge, its lower forward outboard corner the feature.
  out.prism({guard, guard + Vec3(9, 0, 0.6), guard + Vec3(9, 0, 6), guard + Vec3(-3, 0, 6)}, {0, 8, 0}, paint.black, paint.black);
  const double w = 2 * vhf.y();
  const Ring blade{vhf, vhf + Vec3(-1.5, 0, -11), vhf + Vec3(-8, 0, -11), vhf + Vec3(-15, 0, 0), vhf + Vec3(-15, 0, 3), vhf + Vec3(0, 0, 3)};
  out.prism(blade, {0, -w, 0}, paint.pale, paint.pale);
  out.prism({vent, vent + Vec3(9, 0, 1.2), vent + Vec3(9, 0, 6.5), vent + Vec3(0, 0, 5)}, {0, -3.6, 0}, paint.small, paint.small);
  // Clutter that is no feature: another blade, a drain mast, a marker antenna and a beacon.
  out.lens({{186, -7, 69}, {181, -7, 80}, {196, -7, 80}, {192, -7, 69}}, {0, 0.8, 0}, paint.pale);
  out.lens({{276, 6, 74}, {273, 6, 80}, {280, 6, 80}, {278.5, 6, 74}}, {0, 0.5, 0}, paint.small);
  out.lens({{262, -9, 78.2}, {262, 9, 78.2}, {266, 9, 78.2}, {266, -9, 78.2}}, {0, 0, 0.6}, paint.pale);
  add_disc(out, {333, 0, 79.4}, -Vec3::UnitZ(), 2.4, 1, paint.lamp);
}

}  // namespace cyclops::hil::c12

namespace cyclops::hil {

Result<Mesh> c12_mesh(const TankerModel& model) {
  c12::Points points;
  for (const Feature& f : model.features()) points[f.id] = f.p_m.xyz / 0.0254;
  for (int id = 1; id <= 38; ++id)
    if (points.count(id) == 0) return make_error(ErrorCode::kNotFound, "tanker model", "has no feature " + std::to_string(id) + ", expected 1 to 38 of the C-12");
  MeshBuilder out;
  const c12::Paint paint(out);
  for (double side : {1.0, -1.0}) {
    out.side(side);
    c12::add_wing(out, paint, points);
    c12::add_stabiliser(out, paint, points);
    c12::add_nacelle(out, paint, points);
  }
  out.side(1);
  c12::add_fuselage(out, paint);
  c12::add_fin(out, paint, points);
  c12::add_belly(out, paint, points);
  return out.mesh();
}

}  // namespace cyclops::hil
