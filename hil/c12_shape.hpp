#pragma once
/// The parts of the C-12, each added to a builder. Inches, tanker model axes. `Points` is the feature table by number.
/// `side`: +1 right, -1 left; a part is drawn from the features of the right side and mirrored.
#include <map>

#include "hil/mesh.hpp"

namespace cyclops::hil::c12 {

using Points = std::map<int, Vec3>;

inline constexpr double kWhite = 0.78, kBlack = 0.05, kGap = 0.07, kGrey = 0.35, kMetal = 0.28;

[[nodiscard]] inline Vec3 mirrored(const Vec3& p, double side) { return {p.x(), p.y() * side, p.z()}; }

void add_wing(MeshBuilder& out, const Points& f, double side);         ///< 15-20, 30, 32 and their mirrors
void add_stabiliser(MeshBuilder& out, const Points& f, double side);   ///< 1, 7-11, 13 and 3, 4
void add_fuselage(MeshBuilder& out);
void add_fin(MeshBuilder& out, const Points& f);                       ///< 2, 5, 6, 12, 14
void add_nacelle(MeshBuilder& out, const Points& f, double side);      ///< 21, 29 and 28, 33
void add_belly(MeshBuilder& out, const Points& f);                     ///< 31, 35, 37, 38

}  // namespace cyclops::hil::c12
