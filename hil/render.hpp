#pragma once
/// One frame of the camera: sky, tanker and propellers traced through lens and windscreen, then lens, sensor and counts.
///
/// Geometry   rays start from the raw pixels: the inverse of lens and windscreen is tabled at pixel corners, nothing is resampled.
///            4 x 4 samples a pixel, 8 x 8 where materials mix; each sample has its own time within the exposure.
/// Repeatable a function of its arguments: the same seed and frame number give the same bits on one machine, whatever thread
///            renders what. Embree is held to AVX2 and to its robust mode; the machine's mathematical library may still differ.
/// Threads    render() and truth() are const and may run in many; each uses one.
/// Sources    irradiance of the sky is an order-2 spherical harmonic (Ramamoorthi & Hanrahan 2001) times baked ambient occlusion.
///            Formulas: docs/rendering.md.
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "geometry/camera.hpp"
#include "hil/look.hpp"
#include "hil/mesh.hpp"

namespace cyclops::hil {

struct View {
  Pose<frame::C, frame::M> T_c_m{};  ///< middle of the exposure
  Mat3 R_n_c{Mat3::Identity()};      ///< for sky and light
  Mat3 R_n_m{Mat3::Identity()};
  std::uint64_t frame{0};            ///< number, for the noise
  bool moves{false};                 ///< the two below are used: poses at start and end of the exposure
  Pose<frame::C, frame::M> T_c_m_start{}, T_c_m_end{};
};

/// Why a feature is not visible, or should not be scored; a mask.
enum Reason : std::uint32_t {
  kOutOfField = 1, kFacesAway = 2, kOccluded = 4, kInShadow = 8, kSaturated = 16, kAtBorder = 32, kGrazing = 64, kHalfHidden = 128, kBlownOut = 256,
};

struct FeatureTruth {
  std::int32_t id{0};
  Vec2 raw_px{0, 0};
  Vec2 ideal_px{0, 0};           ///< neither windscreen nor lens distortion
  bool in_front{false};          ///< else the pixels say nothing
  bool visible{false};           ///< in the field, facing the camera and nothing before it; shadow and saturation do not count
  bool doubtful{false};          ///< within 3 px of the border, seen at less than 1.5 deg, blown out (all 3 x 3 pixels saturated), or half
                                 ///< hidden: a skin or a bracket so close before it that half the margin decides. Not to be scored
  std::uint32_t reasons{0};      ///< Reason
};

/// kLight: luminance, cd/m2. kMask: share of the pixel that the body covers. kPaint: albedo, 0 beside the body.
enum class Drawing : std::uint8_t { kLight, kMask, kPaint };

class Sky;
class RayScene;

class Renderer {
 public:
  Renderer(Camera camera, Mesh mesh, const Look& look, std::uint64_t seed);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  /// `out` becomes width x height counts, 0 .. the top of the sensor's range.
  void render(const View& view, std::vector<std::uint16_t>& out) const;
  /// One layer of a frame before lens and sensor: what the measurement of corners looks at.
  void draw(const View& view, Drawing what, std::vector<float>& out) const;
  /// Truth of every feature, also of those that are switched off. Occlusion is by this renderer's mesh. `image`: the frame's
  /// counts, to tell saturation; may be null.
  [[nodiscard]] std::vector<FeatureTruth> truth(const View& view, const TankerModel& model, const std::vector<std::uint16_t>* image = nullptr) const;
  /// Raw pixel of a point in camera axes, windscreen and its dependence on range included.
  [[nodiscard]] std::optional<Vec2> project(const Point<frame::C>& p) const;
  [[nodiscard]] const Look& look() const { return look_; }  ///< with the f-number that was set

 private:
  Camera camera_;
  Look look_;
  std::uint64_t seed_;
  std::unique_ptr<Sky> sky_;
  std::unique_ptr<RayScene> rays_;
};

}  // namespace cyclops::hil
