#pragma once
/// What a mesh from a file is checked for before it is drawn: are its parts closed, and which way do they face?
/// Threads  any.
#include <optional>

#include "hil/mesh.hpp"

namespace cyclops::hil {

struct OpenEdge {
  Vec3 from_m{Vec3::Zero()}, to_m{Vec3::Zero()};
  int along{0}, against{0};      ///< triangles that run along it and against it; 1 and 1 where a part is closed
  std::uint16_t material{0};
};

/// Makes vertices at the same place one and removes triangles without area's worth of corners.
void merge_vertices(Mesh& mesh, double nearer_than_m = 1e-6);
/// The first edge that is not shared by two triangles running opposite ways.
[[nodiscard]] std::optional<OpenEdge> find_open_edge(const Mesh& mesh);
/// Turns each connected part with a negative volume inside out. The mesh is closed.
void turn_outwards(Mesh& mesh);

}  // namespace cyclops::hil
