#pragma once
/// Triangles of a body in the tanker model frame.
///
/// Units    metres.
/// Frames   tanker model: x aft, y right wing, z up.
/// Sides    corners of a triangle run anticlockwise as seen from outside; normals point outwards.
/// Threads  a finished mesh may be read from any thread.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/frames.hpp"
#include "geometry/tanker_model.hpp"

namespace cyclops::hil {

struct Material {
  std::string name;
  float albedo{0.5f};            ///< 0..1, diffuse
  float gloss{0};                ///< 0..1, weight of the Fresnel reflection
  bool shades{true};             ///< takes part in ambient occlusion
};

struct Triangle {
  std::array<std::uint32_t, 3> vertex{};
  std::uint16_t material{0};
  std::array<Vec3, 3> normal{Vec3::UnitZ(), Vec3::UnitZ(), Vec3::UnitZ()};  ///< unit, model axes, outwards
};

/// A turning propeller; the renderer draws its time-averaged blade coverage, the mesh holds no blade.
struct Propeller {
  Vec3 hub_m{Vec3::Zero()};
  Vec3 axis{-Vec3::UnitX()};     ///< unit, in the direction of thrust
  double radius_m{0}, hub_radius_m{0};
  int blades{0};
  double blade_chord_m{0}, rpm{0};
  float albedo{0.1f};
};

struct Mesh {
  std::vector<Vec3> vertices_m;
  std::vector<Triangle> triangles;
  std::vector<Material> materials;
  std::vector<Propeller> propellers;
};

/// The C-12 of config/c12: every feature of the table that has a number of the thesis (1 to 38) is a vertex of it.
/// Errors: kNotFound when one of the 38 is missing.
Result<Mesh> c12_mesh(const TankerModel& model);

}  // namespace cyclops::hil
