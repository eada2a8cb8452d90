#pragma once
/// One frame of the camera: sky, the tanker, lens blur, photons, noise and counts. Mono12 in 16-bit words.
///
/// Geometry   exact, see raster.hpp. Time: the pose holds for the whole exposure.
/// Repeatable a function of its arguments: the same seed and frame number give the same bits on one machine, whatever
///            thread renders what.
/// Threads    render() is const and may run in many.
#include <cstdint>
#include <vector>

#include "hil/raster.hpp"

namespace cyclops::hil {

struct Look {
  Light light{};
  double zenith{650};            ///< counts of the sky overhead
  double horizon{1150};          ///< counts at the horizon
  double cloud{120};             ///< counts between bright and dark cloud
  double blur_sigma_px{0.55};    ///< lens
  double electrons_per_count{36.6};
  double read_noise_e{45};
  double black_level{16};        ///< counts
  int columns{4}, rows{16};      ///< samples in a pixel; many rows, for gaps 0.1 px high must not turn into dots
};

struct View {
  Pose<frame::C, frame::M> T_c_m{};
  Mat3 R_n_c{Mat3::Identity()};  ///< for sky and light
  Mat3 R_n_m{Mat3::Identity()};
  std::uint64_t frame{0};        ///< number, for the noise
};

struct FeatureTruth {
  std::int32_t id{0};
  Vec2 raw_px{0, 0};
  bool in_front{false};          ///< else raw_px says nothing
  bool visible{false};           ///< in the field, facing the camera and nothing before it
  bool doubtful{false};          ///< within 3 px of the border, seen at less than 1.5 deg, or half hidden: a skin or a bracket so
                                 ///< close before it that half the margin decides. Not to be scored
};

class Renderer {
 public:
  Renderer(Camera camera, Mesh mesh, const Look& look, std::uint64_t seed);
  /// `out` becomes width x height counts, 0..4095. `background` below 0: the sky, else that many counts everywhere.
  void render(const View& view, std::vector<std::uint16_t>& out, double background = -1) const;
  /// Truth of every feature, also of those that are switched off. Occlusion is by this renderer's mesh.
  [[nodiscard]] std::vector<FeatureTruth> truth(const View& view, const TankerModel& model) const;

 private:
  void sky(const View& view, std::vector<float>& image) const;
  void blur(std::vector<float>& image) const;
  void expose(const View& view, const std::vector<float>& image, std::vector<std::uint16_t>& out) const;
  Camera camera_;
  Mesh mesh_;
  Look look_;
  std::uint64_t seed_;
};

}  // namespace cyclops::hil
