#pragma once
/// Builds closed parts of a mesh from the shapes aircraft are made of.
///
/// Units    inches, as the tanker's drawings and feature table have them; the mesh comes out in metres.
/// Frames   tanker model; with side(-1) every part is mirrored to the left.
/// Result   each part has its corners merged, its triangles turned outwards (positive volume) and one normal a corner:
///          faces that meet at less than the crease angle are smooth.
/// Threads  one at a time.
#include <functional>
#include <vector>

#include "hil/mesh.hpp"

namespace cyclops::hil {

class MeshBuilder {
 public:
  using Ring = std::vector<Vec3>;
  /// Material of the cell between rings i, i+1 and points j, j+1 (the last point joins the first).
  using CellMaterial = std::function<std::uint16_t(std::size_t i, std::size_t j)>;

  [[nodiscard]] std::uint16_t material(const Material& m);
  void side(double right_or_left) { side_ = right_or_left; }
  void crease_deg(double angle) { crease_deg_ = angle; }

  /// Rings of equally many points, joined in order; both ends closed by `ends`, unless a ring is one point.
  void loft(const std::vector<Ring>& rings, const CellMaterial& cell, std::uint16_t ends);
  void loft(const std::vector<Ring>& rings, std::uint16_t m) { loft(rings, [m](auto, auto) { return m; }, m); }
  /// The outline and the same outline moved by `along`, closed at both ends. The outline is convex.
  void prism(const Ring& outline, const Vec3& along, std::uint16_t sides, std::uint16_t ends);
  void box(const Vec3& low, const Vec3& high, std::uint16_t m);
  /// A flat outline that is thickest in its middle: one edge all round, so that each corner is a single point.
  void lens(const Ring& outline, const Vec3& half_thickness, std::uint16_t m);
  /// One face by itself, for boards; not closed.
  void quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, std::uint16_t m);
  void propeller(Propeller p_in);  ///< lengths in inches

  [[nodiscard]] const Mesh& mesh() const { return mesh_; }

 private:
  struct Face { std::array<Vec3, 3> p; std::uint16_t material; };
  void face(const Vec3& a, const Vec3& b, const Vec3& c, std::uint16_t m) { part_.push_back({{a, b, c}, m}); }
  void cap(const Ring& ring, std::uint16_t m, bool turned);
  void finish_part(bool closed);
  Mesh mesh_;
  std::vector<Face> part_;
  double side_{1}, crease_deg_{38};
};

/// Smooth normals: at each corner the mean, by area, of the faces about that vertex that meet this face at less than the angle.
void smooth_normals(Mesh& mesh, std::size_t first_triangle, double crease_deg);

}  // namespace cyclops::hil
