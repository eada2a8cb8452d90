#pragma once
/// Triangles of a body in the tanker model frame, and the few shapes aircraft are made of.
///
/// Units    a Mesh is in metres; MeshBuilder takes inches, as the tanker's drawings and feature table do.
/// Frames   tanker model: x aft, y right wing, z up.
/// Sides    a triangle is seen from both sides; winding does not matter.
/// Threads  a finished mesh may be read from any thread.
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/frames.hpp"
#include "geometry/tanker_model.hpp"

namespace cyclops::hil {

struct Material {
  std::string name;
  float albedo{0.5F};                 ///< 0..1
  float gloss{0};                     ///< 0..1, weight of the Fresnel reflection
  bool shades{true};                  ///< takes part in ambient occlusion
};

struct Triangle {
  std::array<std::uint32_t, 3> vertex{};
  std::uint16_t material{0};
  std::array<Vec3, 3> normal{};       ///< unit, model axes, on the side of the winding
};

/// Turning blades; the renderer draws them as time-averaged coverage of a disc.
struct Propeller {
  Vec3 hub_m{0, 0, 0};
  Vec3 axis{1, 0, 0};
  double radius_m{1.25}, hub_radius_m{0.2};
  int blades{3};
  double blade_chord_m{0.2}, rpm{1700};
  float albedo{0.1F};
};

struct Mesh {
  std::vector<Vec3> vertices_m;
  std::vector<Triangle> triangles;
  std::vector<Material> materials;
  std::vector<Propeller> propellers;
};

class MeshBuilder {
 public:
  using Rows = std::vector<std::vector<Vec3>>;
  /// Albedo of the cell between rows i, i+1 and columns j, j+1; below 0 leaves the cell out.
  using CellAlbedo = std::function<double(std::size_t i, std::size_t j)>;
  void triangle(const Vec3& a, const Vec3& b, const Vec3& c, double albedo);
  void quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double albedo);
  /// Polygon that is convex or star-shaped about its first corner.
  void fan(const std::vector<Vec3>& corners, double albedo);
  /// Rows of equally many points. `smooth`: one normal a point, else one a cell.
  void grid(const Rows& rows, const CellAlbedo& albedo, bool smooth);
  /// A prism: the outline and the same outline moved by `along`, closed at both ends.
  void prism(const std::vector<Vec3>& outline, const Vec3& along, double albedo);
  void box(const Vec3& low, const Vec3& high, double albedo);
  void propeller(const Propeller& p) { mesh_.propellers.push_back(p); }
  [[nodiscard]] const Mesh& mesh() const { return mesh_; }

 private:
  std::uint32_t add(const Vec3& p_in);
  std::uint16_t paint(double albedo);
  Mesh mesh_;
};

/// The C-12 of config/c12: every feature of the table that has a number of the thesis (1 to 38) is a vertex of it.
/// Errors: kNotFound when one of the 38 is missing.
Result<Mesh> c12_mesh(const TankerModel& model);

}  // namespace cyclops::hil
