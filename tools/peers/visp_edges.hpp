#pragma once
/// ViSP's edge tracker behind plain types: its headers are no C++20, so the one file that includes them is compiled as C++17.
///
/// Poses    T_c_k as the upper three rows of a homogeneous matrix. Pixels: 8 bits, row-major, no padding.
/// Errors   false: what ViSP throws when it finds too few edges.
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cyclops::peers {

using Matrix34 = std::array<std::array<double, 4>, 3>;
using Segment = std::array<std::array<double, 3>, 2>;

class VispEdges {
 public:
  /// `cao`: path of a model file; of its sides only `edges` are tracked, all faces hide.
  VispEdges(const std::string& cao, const std::vector<Segment>& edges, double fx, double fy, double cx, double cy);
  ~VispEdges();
  bool start(const std::uint8_t* pixels, unsigned width, unsigned height, const Matrix34& T_c_k);
  bool track(const std::uint8_t* pixels, unsigned width, unsigned height);
  [[nodiscard]] Matrix34 pose() const;

 private:
  class Tracker;
  std::unique_ptr<Tracker> tracker_;
};

}  // namespace cyclops::peers
