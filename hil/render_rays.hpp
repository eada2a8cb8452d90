#pragma once
/// The body as a ray tracer sees it: which triangle lies behind each part of a pixel, how bright it is, what hides what.
///
/// Frames   rays and triangles are in tanker model axes, m. Threads: const use from any; scratch memory is kept per thread.
/// Library  Embree 3, single-threaded builds and queries, AVX2, robust mode.
#include <embree3/rtcore.h>

#include "hil/render.hpp"
#include "hil/sky.hpp"

namespace cyclops::hil {

class RayScene {
 public:
  RayScene(const Camera& camera, Mesh mesh, const Look& look, std::uint64_t seed);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;
  /// Draws the body over `image`.
  void trace(const View& view, const Sky& sky, Drawing what, std::vector<float>& image) const;
  /// Is the way between two points free? Model axes, m; `free_end_m` at the far end does not count.
  [[nodiscard]] bool free(const Vec3& from, const Vec3& to, double free_end_m) const;
  [[nodiscard]] const std::vector<Eigen::Vector2f>& directions() const { return directions_; }
  /// Where the ray of a raw pixel starts, camera axes: the windscreen moves rays sideways.
  [[nodiscard]] Vec3 start(const Vec2& raw_px) const;

  struct Hit { std::uint32_t triangle; float u, v, t; };

 private:
  struct Frame;
  struct Group { std::uint32_t triangle; float n, u, v, t; };
  /// Per corner of a triangle: normal, and the share of the half space that the body leaves free, on both sides.
  struct Corner { Eigen::Vector3f normal; float open[2]; };
  void build();
  void weld();
  void find_seams();
  void bake();
  [[nodiscard]] float openness(const Eigen::Vector3f& p, const Eigen::Vector3f& n) const;
  void mark(Frame& f) const;
  void shoot(const Frame& f, int u, int v, int side, Hit* out) const;
  void shoot_all(Frame& f) const;
  void shade_all(Frame& f, std::vector<float>& image) const;
  [[nodiscard]] float pixel(const Frame& f, int u, int v, const Hit* hits, int side, float background) const;
  [[nodiscard]] float shade(const Frame& f, const Group& g, const Eigen::Vector3f& direction) const;
  [[nodiscard]] float propellers(const Frame& f, int u, int v, int part, float t, float& light) const;
  [[nodiscard]] std::uint16_t material_of(std::uint32_t triangle) const;
  [[nodiscard]] Eigen::Vector2f direction(float u, float v) const;  ///< raw pixel

  Camera camera_;
  Mesh mesh_;
  Look look_;
  std::uint64_t seed_;
  int width_, height_;
  std::vector<Eigen::Vector2f> directions_;
  std::vector<Eigen::Vector3f> points_;                 ///< welded
  std::vector<std::array<std::uint32_t, 3>> index_;     ///< into points_
  std::vector<std::array<Corner, 3>> corners_;
  std::vector<Eigen::Vector3f> flat_;                   ///< unnormalised
  std::vector<std::array<std::uint32_t, 2>> seams_;     ///< edges where materials meet
  RTCDevice device_{nullptr};
  RTCScene scene_{nullptr}, occluders_{nullptr};
};

}  // namespace cyclops::hil
