#pragma once
/// The parts of the C-12, each added to a builder. Inches, tanker model axes. `Points` is the feature table by number.
/// `side`: +1 right, -1 left; a part is drawn from the features of the right side and mirrored by the builder.
#include <map>

#include "hil/mesh_builder.hpp"

namespace cyclops::hil::c12 {

using Points = std::map<int, Vec3>;

struct Paint {
  explicit Paint(MeshBuilder& b)
      : white(b.material({"white paint", 0.74F, 0.6F, true})), boot(b.material({"rubber boot", 0.04F, 0.15F, true})), gap(b.material({"gap", 0.05F, 0, true})),
        black(b.material({"black paint", 0.05F, 0.4F, true})), grey(b.material({"grey trim", 0.25F, 0.6F, true})), metal(b.material({"metal", 0.32F, 0.8F, true})),
        glass(b.material({"glass", 0.05F, 1.0F, true})), lamp(b.material({"lamp", 0.85F, 0.5F, false})), small(b.material({"small part", 0.06F, 0.2F, false})),
        pale(b.material({"pale antenna", 0.62F, 0.3F, false})) {}
  std::uint16_t white, boot, gap, black, grey, metal, glass, lamp, small, pale;
};

void add_wing(MeshBuilder& out, const Paint& paint, const Points& f);                     ///< 15 to 20, 30, 32 and their mirrors
void add_stabiliser(MeshBuilder& out, const Paint& paint, const Points& f);              ///< 1, 7 to 11, 13 and 3, 4
void add_fuselage(MeshBuilder& out, const Paint& paint);
void add_fin(MeshBuilder& out, const Paint& paint, const Points& f);                      ///< 2, 5, 6, 12, 14
void add_nacelle(MeshBuilder& out, const Paint& paint, const Points& f);                  ///< 21, 29 and 28, 33
void add_belly(MeshBuilder& out, const Paint& paint, const Points& f);                    ///< 31, 35, 37, 38

}  // namespace cyclops::hil::c12
