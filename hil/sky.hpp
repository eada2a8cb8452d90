#pragma once
/// Luminance of everything that is not the tanker: clear sky, sun, clouds, twilight, ground and haze.
///
/// Units    cd/m2, lx; directions in NED, unit.
/// Memory   a panorama of sky and ground, drawn once in the constructor. Clouds and ground keep their direction: over a minute of
///          flight their parallax is left out.
/// Threads  const use from any.
/// Sources  CIE clear sky as in Radiance's skybright.cal; sun, twilight and clouds are assumptions, docs/rendering.md.
#include <array>
#include <vector>

#include "geometry/camera.hpp"
#include "hil/look.hpp"

namespace cyclops::hil {

class Sky {
 public:
  Sky(const Look& look, std::uint64_t seed);
  /// Without clouds, ground texture and sun disc: for light on surfaces and reflections.
  [[nodiscard]] double smooth(const Vec3& d_n) const;
  /// Irradiance of smooth() on a surface with this normal, lx.
  [[nodiscard]] double irradiance(const Vec3& normal_n) const;
  [[nodiscard]] double sun_lx() const { return sun_lx_; }  ///< on a surface that faces the sun
  [[nodiscard]] const Vec3& to_sun_n() const { return to_sun_; }
  /// Fills the picture. `rays`: x/z and y/z at the (width + 1) x (height + 1) pixel corners.
  void paint(const std::vector<Eigen::Vector2f>& rays, int width, int height, const Mat3& R_n_c, std::vector<float>& image) const;

 private:
  void draw_panorama(std::uint64_t seed);
  [[nodiscard]] float textured(double azimuth, double elevation, std::uint64_t seed) const;
  [[nodiscard]] double cloud_opacity(double azimuth, double elevation, std::uint64_t seed, double& light) const;
  [[nodiscard]] double clear(const Vec3& d_n, double elevation) const;
  [[nodiscard]] double aureole(double cos_gamma) const;
  Look look_;
  Vec3 to_sun_;
  double zenith_{0}, day_{1}, twilight_{0}, sun_lx_{0}, ground_{0}, disc_{0};
  std::array<double, 9> harmonics_{};
  std::vector<float> panorama_;
};

}  // namespace cyclops::hil
