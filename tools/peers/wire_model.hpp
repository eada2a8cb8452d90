#pragma once
/// The tanker as an edge tracker wants it: polygons that hide, and those of their sides that can be seen as edges.
///
/// Frames   tanker body, metres. A C-12 takes its shape from the flight generator, the very mesh the pictures were drawn from; any
///          other object is the convex hull of its features.
/// Edges    faces meet at more than 30 degrees or differ in paint, and the side is at least 0.3 m long (hull: all sides). Faces without
///          one are left out: 12 000 triangles are beyond what an edge tracker can sort by depth in a frame's time.
#include <string>
#include <vector>

#include "geometry/tanker_model.hpp"

namespace cyclops::peers {

struct WireModel {
  std::vector<Vec3> points_k;
  struct Face {
    std::vector<std::size_t> corner;   ///< in order round the face, anticlockwise from outside
    std::vector<bool> edge;            ///< side from corner i to i + 1
  };
  std::vector<Face> faces;
};

WireModel wire_model(const TankerModel& tanker);

/// ViSP's model file, version 1: points and faces.
std::string as_cao(const WireModel& model);

}  // namespace cyclops::peers
