// Fuselage, fin, nacelles and what hangs below the belly.
#include <cmath>
#include <numbers>

#include "hil/c12_shape.hpp"

namespace cyclops::hil::c12 {
namespace {

constexpr double kPi = std::numbers::pi;

struct Ring {
  double x, half_width, bottom, top;
};

/// Point of a ring at an angle from +y towards +z.
Vec3 on_ring(const Ring& r, double centre_y, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {r.x, centre_y + r.half_width * c, 0.5 * (r.top + r.bottom) + 0.5 * (r.top - r.bottom) * s};
}

constexpr Ring kFuselage[] = {
    {14.2, 0.3, 97.6, 98.4}, {20, 7, 90, 106},       {32, 13, 85.5, 113},      {50, 18.5, 82.5, 119},    {75, 23.5, 80.4, 124},
    {98, 26.8, 79.4, 131},   {120, 28.8, 78.9, 146}, {140, 29.5, 78.7, 150.2}, {200, 29.5, 78.7, 150.2}, {260, 29.5, 78.7, 150.2},
    {311, 29.4, 78.72, 150}, {345, 27.8, 81, 148.6}, {380, 24, 86, 146},       {415, 19.4, 92.5, 142},   {450, 14, 100, 137.5},
    {480, 9.2, 107, 133.5},  {500, 6, 112.5, 130.5}, {511, 4, 117, 129},       {511, 0.2, 122.9, 123.1}};

MeshBuilder::Rows rings(const Ring* r, std::size_t n, double centre_y, const std::vector<double>& angles) {
  MeshBuilder::Rows rows;
  for (std::size_t i = 0; i < n; ++i) {
    rows.emplace_back();
    for (double a : angles) rows.back().push_back(on_ring(r[i], centre_y, a));
  }
  return rows;
}

/// Half of a symmetric body of diamond section between two tips on the centreline.
void add_bullet(MeshBuilder& out, const Vec3& fore, const Vec3& aft) {
  const double length = aft.x() - fore.x();
  const double shape[] = {0, 0.08, 0.25, 0.5, 0.75, 0.92, 1}, radius[] = {0, 2.0, 4.1, 4.8, 3.9, 1.9, 0};
  MeshBuilder::Rows rows;
  for (int i = 0; i < 7; ++i) {
    rows.emplace_back();
    for (int k = 0; k <= 16; ++k) {
      const double a = 2 * kPi * (k % 16) / 16;
      rows.back().push_back(i == 0 ? fore : i == 6 ? aft : fore + Vec3(shape[i] * length, radius[i] * std::cos(a), radius[i] * std::sin(a)));
    }
  }
  out.grid(rows, [](auto, auto) { return kWhite; }, true);
}

/// A plate standing on the plane of symmetry: profile points x, z at mid chord thicker by `half`.
void add_plate(MeshBuilder& out, const Vec3& le_low, const Vec3& te_low, const Vec3& te_high, const Vec3& le_high, double half, double albedo) {
  const Vec3 low = le_low + 0.4 * (te_low - le_low), high = le_high + 0.4 * (te_high - le_high);
  for (double side : {-1.0, 1.0}) {
    const Vec3 y(0, side * half, 0);
    out.quad(le_low, low + y, high + y, le_high, albedo);
    out.quad(low + y, te_low, te_high, high + y, albedo);
  }
}

/// A blade antenna: tapers to one edge all round, so that its corners are single points.
void add_blade(MeshBuilder& out, const std::vector<Vec3>& outline, double half, double albedo) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : outline) middle += p / static_cast<double>(outline.size());
  for (double side : {-1.0, 1.0})
    for (std::size_t i = 0; i < outline.size(); ++i) out.triangle(outline[i], outline[(i + 1) % outline.size()], middle + Vec3(0, side * half, 0), albedo);
}

}  // namespace

void add_fuselage(MeshBuilder& out) {
  std::vector<double> angles;
  for (int k = 0; k <= 48; ++k) angles.push_back(2 * kPi * (k % 48) / 48);
  constexpr std::size_t n = std::size(kFuselage);
  out.grid(rings(kFuselage, n, 0, angles), [&](std::size_t i, std::size_t j) {
    const double x = 0.5 * (kFuselage[i].x + kFuselage[std::min(i + 1, n - 1)].x);
    const bool high = j >= 5 && j < 19;
    if (x > 100 && x < 130 && high && (j < 11 || j > 12)) return 0.06;           // windows of the cockpit
    if (x > 145 && x < 400 && (j == 1 || j == 22)) return kGrey;                 // cheat line
    return kWhite;
  }, true);
}

void add_fin(MeshBuilder& out, const Points& f) {
  add_plate(out, {408, 0, 142}, {521, 0, 124}, {507, 0, 209}, {462, 0, 209}, 3.4, kWhite);
  add_plate(out, {350, 0, 147}, {430, 0, 139}, {430, 0, 165}, {408, 0, 150}, 1.2, kWhite);       // dorsal fillet
  add_plate(out, {425, 0, 96}, {495, 0, 112}, {500, 0, 97}, {452, 0, 95}, 1.0, kWhite);          // ventral fin
  add_bullet(out, f.at(6), f.at(2));
  for (int id : {5, 12}) {  // VOR blades: horizontal plates, one edge all round
    const Vec3 p = f.at(id);
    const double s = p.y() > 0 ? 1 : -1;
    out.fan({p, p + Vec3(-6.5, 0, 0), p + Vec3(-14, -s * 13.5, 0), p + Vec3(2, -s * 13.5, 0)}, kBlack);
  }
  const Vec3 light = f.at(14);  // lamp of diamond section; its lowest corner is the feature
  const std::vector<Vec3> rim{light, light + Vec3(0, 2.2, 3.4), light + Vec3(0, 0, 6.8), light + Vec3(0, -2.2, 3.4)};
  out.prism(rim, {-8, 0, 0}, kGrey);
  out.fan(rim, 0.9);
}

void add_nacelle(MeshBuilder& out, const Points& f, double side) {
  const Vec3 corner = f.at(29);
  const double zc = 92.2, dy = corner.y() - 103, dz = corner.z() - zc, radius = std::hypot(dy, dz);
  const double theta = std::atan2(dz, dy);  // below the horizon: negative
  const auto ring = [](double x, double z, double r) { return Ring{x, r, z - r, z + r}; };
  const Ring rs[] = {ring(104, 104.75, 0.2), ring(110, 104.75, 5),   ring(119, 104.75, 8.5), ring(121, 104, 12.5), ring(128, 102.5, 17),
                     ring(150, 101, 19),     ring(186, 99.5, 19),    ring(210, 96.5, 17.2),  ring(corner.x(), zc, radius), ring(250, 90, 7.5), ring(262, 89, 0.2)};
  std::vector<double> angles;
  for (int k = 0; k <= 12; ++k) angles.push_back(theta + (kPi - 2 * theta) * k / 12);             // over the top, white
  for (int k = 1; k <= 8; ++k) angles.push_back(kPi - theta + (kPi + 2 * theta) * k / 8);         // below, black panel
  auto rows = rings(rs, std::size(rs), 103, angles);
  rows[8].front() = rows[8].back() = corner;
  for (auto& row : rows) {
    row.back() = row.front();
    for (Vec3& p : row) p.y() *= side;
  }
  out.grid(rows, [](std::size_t i, std::size_t j) {
    if (i <= 1) return kMetal;
    return i >= 6 && i <= 7 && j >= 12 ? kBlack : kWhite;
  }, true);
  // The outboard exhaust: a short tube, its end a dark octagon with one corner at the feature; the inboard one mirrors it.
  const Vec3 lip = f.at(21);
  const double away = std::atan2(-0.838, 0.546);
  const Vec3 centre = lip - 3.4 * Vec3(0, std::cos(away), std::sin(away));
  std::vector<Vec3> end;
  for (int k = 0; k < 8; ++k) end.push_back(k == 0 ? lip : centre + 3.4 * Vec3(0, std::cos(away + k * kPi / 4), std::sin(away + k * kPi / 4)));
  for (double stack : {1.0, -1.0}) {
    std::vector<Vec3> rim = end;
    for (Vec3& p : rim) p.y() = side * (103 + stack * (p.y() - 103));
    out.prism(rim, {-15, -side * stack * 6, 1}, kMetal);
    out.fan(rim, kBlack);
  }
}

void add_belly(MeshBuilder& out, const Points& f) {
  const Vec3 black = f.at(31), guard = f.at(35), vhf = f.at(37), vent = f.at(38);
  add_blade(out, {black, black + Vec3(-6, 0, 15), black + Vec3(8, 0, 15), black + Vec3(5.5, 0, 0)}, 0.5, kBlack);
  // Guard against stones: a wedge, its lower forward outboard corner the feature.
  out.prism({guard, guard + Vec3(9, 0, 0.6), guard + Vec3(9, 0, 6), guard + Vec3(-3, 0, 6)}, {0, 6, 0}, kBlack);
  const double w = 2 * vhf.y();
  out.prism({vhf, vhf + Vec3(-1, 0, -11), vhf + Vec3(-7, 0, -11), vhf + Vec3(-14, 0, 0), vhf + Vec3(-14, 0, 3), vhf + Vec3(0, 0, 3)}, {0, -w, 0}, kWhite * 0.9);
  out.box(vent, vent + Vec3(9, -3.2, 5), kBlack);
  add_blade(out, {{188, -8, 70}, {184, -8, 80}, {196, -8, 80}, {193, -8, 70}}, 0.5, kBlack);
}

}  // namespace cyclops::hil::c12

namespace cyclops::hil {

Result<Mesh> c12_mesh(const TankerModel& model) {
  c12::Points points;
  for (const Feature& f : model.features()) points[f.id] = f.p_m.xyz / 0.0254;
  for (int id = 1; id <= 38; ++id)
    if (points.count(id) == 0) return make_error(ErrorCode::kNotFound, "tanker model", "has no feature " + std::to_string(id) + ", expected 1 to 38 of the C-12");
  MeshBuilder out;
  for (double side : {1.0, -1.0}) {
    c12::add_wing(out, points, side);
    c12::add_stabiliser(out, points, side);
    c12::add_nacelle(out, points, side);
  }
  c12::add_fuselage(out);
  c12::add_fin(out, points);
  c12::add_belly(out, points);
  for (double side : {1.0, -1.0}) out.propeller({Vec3(120, 103 * side, 104.75) * 0.0254, {1, 0, 0}, 49.25 * 0.0254, 9 * 0.0254, 3, 7.5 * 0.0254, 1700, 0.08F});
  return out.mesh();
}

}  // namespace cyclops::hil
