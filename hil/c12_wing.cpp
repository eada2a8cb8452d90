// Wings and stabiliser: grids whose lines follow boots, hinges and gaps, so that painted corners are vertices.
#include <cmath>

#include "hil/c12_shape.hpp"

namespace cyclops::hil::c12 {
namespace {

/// The line through two features as a function of y.
Vec3 on_line(const Vec3& a, const Vec3& b, double y) { return a + (b - a) * ((y - a.y()) / (b.y() - a.y())); }

/// z of a point exact at a feature, elsewhere what `model` says.
struct WingPlan {
  static double chord(double y) { return y <= 103 ? 85.75 - y * (3.73 / 103) : 82.02 - (y - 103) * (46.395 / 224); }
  static double leading(double y) { return 188.83 - 0.25 * chord(y); }
  static double thickness(double y) { return (0.18 - 0.06 * y / 327) * chord(y); }
};

/// Lower surface of the wing along chord fraction s: boot line, hinge line and trailing edge go through features.
class WingLower {
 public:
  explicit WingLower(const Points& f) : f_(f) {}
  [[nodiscard]] Vec3 leading(double y) const { return {WingPlan::leading(y), y, boot(y).z() + 0.36 * WingPlan::thickness(y)}; }
  [[nodiscard]] Vec3 boot(double y) const {
    const Vec3 &a = f_.at(32), &b = f_.at(20), &c = f_.at(16);
    return y <= b.y() ? on_line(a, b, y) : on_line(b, c, y);
  }
  /// Aft side of the gap before flap (y up to 199.5) and aileron.
  [[nodiscard]] Vec3 hinge(double y) const {
    Vec3 p = on_line(f_.at(30), f_.at(17), y);
    const double share = y < 200 ? 0.69 : 0.78;
    p.x() = WingPlan::leading(y) + share * WingPlan::chord(y) + 0.9;
    if (y == f_.at(30).y()) p = f_.at(30);
    if (y == f_.at(17).y()) p = f_.at(17);
    return p;
  }
  [[nodiscard]] Vec3 trailing(double y) const {
    Vec3 p = on_line(f_.at(19), f_.at(15), y);
    p.x() = WingPlan::leading(y) + WingPlan::chord(y) + (y < 200 ? 1.2 : 0);
    if (y == f_.at(19).y()) p = f_.at(19);
    if (y == f_.at(15).y()) p = f_.at(15);
    return p;
  }

 private:
  const Points& f_;
};

Vec3 mix(const Vec3& a, const Vec3& b, double t) { return a + (b - a) * t; }

std::vector<Vec3> lower_column(const WingLower& w, double y) {
  const Vec3 le = w.leading(y), boot = w.boot(y), aft = w.hinge(y), te = w.trailing(y);
  const Vec3 fore = aft - Vec3(0.9, 0, 0);
  // Under the boot the skin is nearly flat, so that the boot's aft edge can be seen from behind; the nose is blunt.
  Vec3 nose = le + Vec3(0.02 * WingPlan::chord(y), 0, 0);
  nose.z() = boot.z() + (0.092 - 0.026 * y / 316) * (boot.x() - nose.x());
  return {le, nose, boot, mix(boot, fore, 0.33), mix(boot, fore, 0.66), fore, aft, mix(aft, te, 0.5), te};
}

std::vector<Vec3> upper_column(const WingLower& w, double y) {
  const Vec3 le = w.leading(y), te = w.trailing(y);
  const double t = WingPlan::thickness(y);
  const auto at = [&](double s, double rise) {
    Vec3 p = mix(le, te, s);
    p.z() += rise * t;
    return p;
  };
  return {le, at(0.04, 0.24), at(0.1, 0.4), at(0.25, 0.56), at(0.45, 0.53), at(0.7, 0.33), te};
}

void add_mirrored(MeshBuilder& out, MeshBuilder::Rows rows, double side, const MeshBuilder::CellAlbedo& albedo, bool smooth) {
  for (auto& row : rows)
    for (Vec3& p : row) p.y() *= side;
  out.grid(rows, albedo, smooth);
}

void add_tip(MeshBuilder& out, const std::vector<Vec3>& low, const std::vector<Vec3>& high, double side) {
  const double y = 327;
  const Vec3 a(WingPlan::leading(y) + 5, y, low.front().z() + 1.6), b(WingPlan::leading(y) + 24, y, low.back().z() + 1.4);
  const auto strip = [&](const std::vector<Vec3>& edge) {
    for (std::size_t i = 0; i + 1 < edge.size(); ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(edge.size() - 1), t = static_cast<double>(i + 1) / static_cast<double>(edge.size() - 1);
      out.quad(mirrored(edge[i], side), mirrored(edge[i + 1], side), mirrored(mix(a, b, t), side), mirrored(mix(a, b, s), side), kWhite);
    }
  };
  strip(low);
  strip(high);
}

}  // namespace

void add_wing(MeshBuilder& out, const Points& f, double side) {
  const WingLower w(f);
  const std::vector<double> ys{0, 31.5, f.at(30).y(), f.at(32).y(), 60, 85, 103, f.at(20).y(), 160, f.at(19).y(), f.at(17).y(), 240, 280, 315, f.at(16).y(), f.at(15).y()};
  MeshBuilder::Rows low, high;
  for (double y : ys) {
    low.push_back(lower_column(w, y));
    high.push_back(upper_column(w, y));
  }
  const auto booted = [&](std::size_t i) { return (ys[i] >= 34 && ys[i + 1] <= 85) || (ys[i] >= 125 && ys[i + 1] <= 316); };
  add_mirrored(out, low, side, [&](std::size_t i, std::size_t j) {
    if (j <= 1) return booted(i) ? kBlack : kWhite;
    const bool between = ys[i] >= 199 && ys[i + 1] <= 201, root = ys[i] == 31.5;
    if (j == 5 && ys[i] >= 31 && ys[i + 1] <= 316) return kGap;
    if (j >= 6 && (between || root || ys[i] == 315)) return kGap;
    return kWhite;
  }, false);
  add_mirrored(out, high, side, [&](std::size_t i, std::size_t j) { return j <= 1 && booted(i) ? kBlack : kWhite; }, false);
  add_tip(out, low.back(), high.back(), side);
  const Vec3 tip = f.at(18);  // a fuel drain: a small pyramid that stands on its point
  const double z = tip.z() + 2.7;
  const Vec3 base[4] = {{tip.x() - 1.5, tip.y() - 0.8, z}, {tip.x() + 0.8, tip.y() - 0.8, z}, {tip.x() + 0.8, tip.y() + 0.8, z}, {tip.x() - 1.5, tip.y() + 0.8, z}};
  for (int i = 0; i < 4; ++i) out.triangle(mirrored(base[i], side), mirrored(base[(i + 1) % 4], side), mirrored(tip, side), kMetal);
}

namespace {

struct StabPlan {
  const Points& f;
  [[nodiscard]] double trailing(double y) const { return on_line(f.at(7), f.at(10), y).x(); }
  [[nodiscard]] double chord(double y) const { return y == f.at(1).y() ? (trailing(y) - f.at(1).x()) / 0.65 : (trailing(y) - on_line(f.at(11), f.at(13), y).x()) / 0.915; }
  [[nodiscard]] double depth(double s, double y) const { return (s < 0.05 ? 0.0247 : s < 0.3 ? 0.0349 : s < 0.5 ? 0.04713 : 0.034) * chord(y); }
  [[nodiscard]] Vec3 at(double s, double y, double dx = 0) const {
    const double c = chord(y);
    if (s >= 1) return {trailing(y), y, 211};
    if (s <= 0) return {trailing(y) - c, y, 211};
    return {trailing(y) - c * (1 - s) + dx, y, 211 - depth(s, y)};
  }
};

/// Bracket of an elevator hinge: a dark wedge below the hinge line; its outboard lower aft corner is the feature.
void add_bracket(MeshBuilder& out, const Vec3& p, double side) {
  const std::vector<Vec3> outline{p, p + Vec3(0.5, 0, 2.4), p + Vec3(-5, 0, 2.4)};
  out.prism(outline, {0, -1.2 * side, 0}, kBlack);
}

}  // namespace

void add_stabiliser(MeshBuilder& out, const Points& f, double side) {
  const StabPlan s{f};
  const std::vector<double> ys{0, f.at(7).y(), f.at(11).y(), 26, 60, 99.2, 100, f.at(13).y(), f.at(1).y()};
  MeshBuilder::Rows low, high;
  for (double y : ys) {
    std::vector<Vec3> column{s.at(0, y), s.at(0.02, y), s.at(0.085, y), s.at(0.35, y), s.at(0.35, y, 0.8), s.at(0.716, y, -0.4), s.at(0.716, y, 0.4), s.at(1, y)};
    if (y == f.at(11).y()) column[2] = f.at(11);
    if (y == f.at(13).y()) column[2] = f.at(13);
    if (y == f.at(1).y()) column[3] = f.at(1);
    if (y == f.at(7).y()) column.back() = f.at(7);
    if (y == f.at(1).y()) column.back() = f.at(10);
    low.push_back(column);
    for (Vec3& p : column) p.z() = 422 - p.z();
    high.push_back(column);
  }
  const auto paint = [&](std::size_t i, std::size_t j) {
    const bool horn = ys[i] >= 100;
    if (ys[i] < 7 && j >= 6) return -1.0;  // the elevators end beside the bullet
    if (j <= 1) return ys[i] >= 9 && ys[i + 1] <= 104 ? kBlack : kWhite;
    if (j == 3 && ys[i] >= 99) return kGap;
    if (ys[i] == 99.2 && (j == 4 || j == 5)) return kGap;
    if (j == 5 && !horn) return kGap;
    return kWhite;
  };
  add_mirrored(out, low, side, paint, false);
  add_mirrored(out, high, side, paint, false);
  const std::size_t last = low.size() - 1;
  for (std::size_t j = 0; j + 1 < low[last].size(); ++j)
    out.quad(mirrored(low[last][j], side), mirrored(low[last][j + 1], side), mirrored(high[last][j + 1], side), mirrored(high[last][j], side), kWhite);
  for (int id : {8, 9}) add_bracket(out, mirrored(f.at(id), side), side);  // those of the left side are no features, but there
}

}  // namespace cyclops::hil::c12
