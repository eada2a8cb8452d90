#pragma once
/// A tanker's shape from a file: OBJ, glTF, STL or PLY, read by Assimp; or one that is built in.
///
/// Frames   the file's axes are told by `axes`; the mesh comes out in tanker model axes and metres.
/// Paint    albedo is the luminance of a material's diffuse colour, gloss that of its specular colour. No textures.
/// Errors   kNotFound: no such file; kUnsupported: another kind of file; kCorrupt: Assimp cannot read it, or a vertex is not finite;
///          kTruncated: no triangle; kInvalid: open or twisted parts, or a feature without a corner of the mesh near it.
///          All name the file, the place and the value.
/// Threads  any; each call reads for itself.
#include <array>
#include <string>

#include "base/config.hpp"
#include "hil/mesh.hpp"

namespace cyclops::hil {

struct MeshFileConfig {
  double metres_per_unit{0.0254};
  std::array<std::string, 3> axes{"aft", "right", "up"};  ///< where the file's x, y and z point: aft forward right left up down
  bool allow_open{false};                                 ///< take a mesh with holes; its triangles stay as they are wound
  double crease_deg{38};                                  ///< faces that meet at less are smooth
};

/// Shape of the scenario's tanker. In TOML: mesh, mesh_unit, mesh_axes, mesh_allow_open, mesh_crease_deg, mesh_feature_tolerance_in.
struct TankerMeshConfig {
  std::string mesh{"c12"};           ///< "c12" or a path
  MeshFileConfig file{};
  double feature_tolerance_m{0.00254};  ///< a feature needs a vertex of the mesh as near as this

  /// Reads the keys of `t`; what it does not say stays. A path is taken against the file's folder. Errors are left in the table.
  void read(ConfigTable& t, const ConfigFile& from);
};

Result<Mesh> load_mesh(const std::string& path, const MeshFileConfig& config);
/// The mesh, with a vertex near every feature of the model. Errors about a feature say its number, name and place.
Result<Mesh> tanker_mesh(const TankerMeshConfig& config, const TankerModel& model);

}  // namespace cyclops::hil
