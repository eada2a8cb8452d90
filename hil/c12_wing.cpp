// Wings and stabiliser: closed sections whose points follow boots, hinges and gaps, so that painted corners are vertices.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/c12_shape.hpp"

namespace cyclops::hil::c12 {
namespace {

using Ring = MeshBuilder::Ring;

/// The line through two features as a function of y.
Vec3 on_line(const Vec3& a, const Vec3& b, double y) { return a + (b - a) * ((y - a.y()) / (b.y() - a.y())); }
Vec3 mix(const Vec3& a, const Vec3& b, double t) { return a + (b - a) * t; }

/// Half thickness of a NACA four-digit section at chord fraction s, of full thickness 1 (Abbott and von Doenhoff 1959, 6.4).
double half_thickness(double s) { return 5 * (0.2969 * std::sqrt(s) - 0.126 * s - 0.3516 * s * s + 0.2843 * s * s * s - 0.1036 * s * s * s * s); }

/// From the leading edge to where the lower skin begins: a quarter of an ellipse, both ends left out.
void add_nose(Ring& ring, const Vec3& le, const Vec3& skin) {
  for (double deg : {22.0, 45.0, 68.0}) {
    const double a = deg * std::numbers::pi / 180;
    ring.emplace_back(skin.x() - (skin.x() - le.x()) * std::cos(a), le.y(), le.z() + (skin.z() - le.z()) * std::sin(a));
  }
}

constexpr double kBreak_in = 103, kFlapEnd_in = 200, kGap_in = 0.9;

struct WingPlan {  // chords: config/c12/README.md
  static double chord(double y) { return y <= kBreak_in ? 85.75 - y * (3.73 / 103) : 82.02 - (y - 103) * (46.395 / 224); }
  static double leading(double y) { return 188.83 - 0.25 * chord(y); }
  static double thickness(double y) { return (0.18 - 0.06 * y / 327) * chord(y); }
};

/// Section of the wing: boot line, hinge line and trailing edge go through features.
class Wing {
 public:
  enum : std::size_t { kLe = 0, kSkin = 4, kBoot = 5, kFore = 8, kAft = 9, kTe = 11, kUpperAft = 13, kUpperFore = 14, kUpperBoot = 17, kCount = 21 };
  explicit Wing(const Points& f) : f_(f) {}

  [[nodiscard]] Vec3 boot(double y) const {
    const double at = flat(y);
    const Vec3 &a = f_.at(32), &b = f_.at(20), &c = f_.at(16);
    Vec3 p = at <= b.y() ? on_line(a, b, at) : on_line(b, c, at);
    p.y() = y;
    return p;
  }
  [[nodiscard]] Vec3 hinge(double y) const {
    Vec3 p = on_line(f_.at(30), f_.at(17), flat(y));
    p.x() = WingPlan::leading(y) + (y < kFlapEnd_in ? 0.69 : 0.78) * WingPlan::chord(y) + kGap_in;
    p.y() = y;
    for (int id : {30, 17})
      if (y == f_.at(id).y()) p = f_.at(id);
    return p;
  }
  [[nodiscard]] Vec3 trailing(double y) const {
    Vec3 p = on_line(f_.at(19), f_.at(15), flat(y));
    p.x() = WingPlan::leading(y) + WingPlan::chord(y) + (y < kFlapEnd_in ? 1.2 : 0);
    p.y() = y;
    for (int id : {19, 15})
      if (y == f_.at(id).y()) p = f_.at(id);
    return p;
  }
  [[nodiscard]] Vec3 leading(double y) const { return {WingPlan::leading(y), y, boot(y).z() + 0.36 * WingPlan::thickness(y)}; }

  [[nodiscard]] Ring section(double y) const {
    const Vec3 le = leading(y), edge = boot(y), aft = hinge(y), te = trailing(y), fore = aft - Vec3(kGap_in, 0, 0);
    const double chord = WingPlan::chord(y), t = WingPlan::thickness(y);
    // Under the boot the skin is nearly flat, so that the boot's aft edge can be seen from behind; the nose is blunt.
    Vec3 skin = le + Vec3(0.05 * chord, 0, 0);
    skin.z() = edge.z() + 0.02 * (edge.x() - skin.x());
    Ring ring{le};
    add_nose(ring, le, skin);
    for (const Vec3& p : {skin, edge, mix(edge, fore, 0.33), mix(edge, fore, 0.66), fore, aft, mix(aft, te, 0.5), te}) ring.push_back(p);
    const auto top = [&](double s) {
      Vec3 p = mix(le, te, s);
      p.z() += 1.12 * half_thickness(s) * t;
      return p;
    };
    const double hinge_share = (aft.x() - le.x()) / (te.x() - le.x()), boot_share = 0.7 * (edge.x() - le.x()) / (te.x() - le.x());
    for (double s : {0.5 * (1 + hinge_share), hinge_share, hinge_share - kGap_in / chord, 0.5, 0.3, boot_share, 0.045, 0.015, 0.004}) ring.push_back(top(s));
    return ring;
  }

 private:
  /// Between the wing roots the belly is flat.
  [[nodiscard]] double flat(double y) const { return std::max(y, f_.at(30).y() - 3); }
  const Points& f_;
};

void add_tip_cap(MeshBuilder& out, const Paint& paint, const Wing& w, double y_end) {
  // It ends ahead of the aileron, whose outboard corner therefore stands free.
  const Vec3 le = w.leading(y_end);
  struct Station { double y, x0, x1, thick, rise; };
  const Station stations[] = {{y_end + 3, 0.8, 24.5, 3.3, 0.4}, {y_end + 4.5, 1.6, 24.2, 3.1, 0.55}, {y_end + 6.5, 3.6, 23.6, 2.5, 0.8}, {y_end + 8.1, 6.5, 22.4, 1.6, 1.0}, {y_end + 8.9, 10, 20.5, 0.7, 1.1}};
  std::vector<Ring> rings;
  for (const Station& s : stations) {
    Ring ring;
    for (int k = 0; k < 16; ++k) {
      const double a = 2 * std::numbers::pi * k / 16, c = std::cos(a);
      ring.emplace_back(le.x() + 0.5 * (s.x0 + s.x1) - 0.5 * (s.x1 - s.x0) * c, s.y, le.z() - 0.25 + s.rise + 0.5 * s.thick * std::sin(a));
    }
    rings.push_back(ring);
  }
  out.loft(rings, paint.white);
}

void add_flap_track(MeshBuilder& out, const Paint& paint, const Wing& w, double y) {
  const Vec3 a = w.hinge(y), b = w.trailing(y);
  const Vec3 p = mix(a, b, -0.35), q = mix(a, b, 0.05), r = mix(a, b, 0.75);
  out.prism({p - Vec3(0, 0.6, -0.4), q - Vec3(0, 0.6, 1.9), r - Vec3(0, 0.6, 0.9), r - Vec3(0, 0.6, -0.6)}, {0, 1.2, 0}, paint.pale, paint.pale);
}

/// The end of the aileron is raked: ahead of its trailing edge the wing reaches further out, so that the corner stays blunt
/// when it is seen from behind the fuselage.
Ring raked(Ring ring) {
  constexpr double kRake = 0.3, kUpTo_in = 14, kDihedral = 0.122;
  const double te = ring[Wing::kTe].x();
  for (Vec3& p : ring) {
    const double out = kRake * std::min(te - p.x(), kUpTo_in);
    p += Vec3(0, out, kDihedral * out);
  }
  return ring;
}

}  // namespace

void add_wing(MeshBuilder& out, const Paint& paint, const Points& f) {
  const Wing w(f);
  const double root = f.at(30).y(), boot_root = f.at(32).y(), boot_mid = f.at(20).y(), flap = f.at(19).y(), aileron = f.at(17).y(), boot_tip = f.at(16).y(), tip = f.at(15).y();
  const std::vector<double> ys{10, root - 3, root - kGap_in, root, boot_root, 48, 66, 84, 103, boot_mid, 145, 165, 183, flap, aileron, 220, 242, 262, 282, 300, boot_tip, tip};
  std::vector<Ring> rings;
  for (double y : ys) rings.push_back(y == tip ? raked(w.section(y)) : w.section(y));
  out.loft(rings, [&](std::size_t i, std::size_t j) {
    const double y0 = ys[i], y1 = ys[i + 1];
    const bool booted = (y0 >= boot_root && y1 <= 84) || (y0 >= boot_mid && y1 <= boot_tip);
    if (booted && (j < Wing::kBoot || j >= Wing::kUpperBoot)) return paint.boot;
    if ((j == Wing::kFore || j == Wing::kUpperAft) && y0 >= root - 1) return paint.gap;
    const bool aft = j >= Wing::kAft && j < Wing::kUpperAft, strip = y1 == root || y0 == flap;
    return aft && strip ? paint.gap : paint.white;
  }, paint.white);
  add_tip_cap(out, paint, w, tip);
  for (double y : {62.0, 158.0}) add_flap_track(out, paint, w, y);
  const Vec3 drain = f.at(18);  // a fuel drain: a small pyramid that stands on its point
  const double z = drain.z() + 2.9;
  out.loft({{{drain.x() - 1.8, drain.y() - 0.9, z}, {drain.x() + 0.9, drain.y() - 0.9, z}, {drain.x() + 0.9, drain.y() + 0.9, z}, {drain.x() - 1.8, drain.y() + 0.9, z}}, Ring(4, drain)}, paint.small);
}

namespace {

class Stabiliser {
 public:
  enum : std::size_t { kBoot = 5, kHorn = 6, kHinge = 8, kTe = 10 };
  explicit Stabiliser(const Points& f) : f_(f) {}
  [[nodiscard]] double trailing(double y) const { return on_line(f_.at(7), f_.at(10), y).x(); }
  [[nodiscard]] double chord(double y) const { return (trailing(y) - on_line(f_.at(11), f_.at(13), y).x()) / 0.915; }
  [[nodiscard]] Ring section(double y, double end = 1) const {
    const double c = chord(y), le = trailing(y) - c;
    const auto at = [&](double s, double depth, double dx = 0) { return Vec3(le + s * c + dx, y, kPlane_in - depth * c); };
    Ring lower{at(0, 0)};
    add_nose(lower, at(0, 0), at(0.03, 0.0319));
    for (const Vec3& p : {at(0.03, 0.0319), at(0.085, 0.0349), at(0.35, 0.0471), at(0.35, 0.0471, 0.8), at(0.716, 0.034, -0.4)}) lower.push_back(p);
    if (end >= 1) for (const Vec3& p : {at(0.716, 0.034, 0.4), Vec3(trailing(y), y, kPlane_in)}) lower.push_back(p);
    for (Vec3& p : lower)
      for (int id : {1, 7, 10, 11, 13})
        if ((p - f_.at(id)).norm() < 0.02) p = f_.at(id);
    Ring ring = lower;
    for (std::size_t k = lower.size() - (end >= 1 ? 1 : 0); k-- > 1;) ring.emplace_back(lower[k].x(), y, 2 * kPlane_in - lower[k].z());
    return ring;
  }

 private:
  static constexpr double kPlane_in = 211;
  const Points& f_;
};

/// Bracket of an elevator hinge: a dark block below the hinge line; its outboard lower aft corner is the feature.
void add_bracket(MeshBuilder& out, const Paint& paint, const Vec3& p) {
  out.prism({p, p + Vec3(0, 0, 3.2), p + Vec3(-8, 0, 3.2), p + Vec3(-6, 0, 0.2)}, {0, -1.7, 0}, paint.small, paint.small);
}

}  // namespace

void add_stabiliser(MeshBuilder& out, const Paint& paint, const Points& f) {
  const Stabiliser s(f);
  const double root = f.at(7).y(), boot_root = f.at(11).y(), boot_tip = f.at(13).y(), tip = f.at(1).y();
  const std::vector<double> ys{root, boot_root, 26.6, 45, 65, 84.6, 99.2, 100, boot_tip, tip};
  std::vector<Ring> rings;
  for (double y : ys) rings.push_back(s.section(y));
  const std::size_t n = rings.front().size();
  out.loft(rings, [&](std::size_t i, std::size_t j) {
    const std::size_t k = j < Stabiliser::kTe ? j : n - 1 - j;  // the upper side as the lower
    if (k < Stabiliser::kBoot) return ys[i] >= boot_root && ys[i + 1] <= boot_tip ? paint.boot : paint.white;
    if (k == Stabiliser::kHorn && ys[i] >= 99) return paint.gap;
    if (ys[i] == 99.2 && (k == Stabiliser::kHorn + 1 || k == Stabiliser::kHinge)) return paint.gap;
    return k == Stabiliser::kHinge && ys[i] < 100 ? paint.gap : paint.white;
  }, paint.white);
  out.loft({s.section(0.5, 0), s.section(root + 0.3, 0)}, paint.grey);   // carries through the bullet; the elevators do not
  for (int id : {8, 9}) add_bracket(out, paint, f.at(id));              // those of the left side are no features, but there
}

}  // namespace cyclops::hil::c12
