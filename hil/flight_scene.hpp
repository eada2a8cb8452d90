#pragma once
/// What both halves of a flight, pictures and navigation, know of it: the world as it is.
///
/// Time     s from the start of the flight, unless a name says otherwise. Threads: const use from any.
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>

#include "hil/motion.hpp"
#include "hil/render.hpp"
#include "hil/scenario.hpp"

namespace cyclops::hil {

inline constexpr std::int64_t kServiceStart_ns = 1'000'000'000'000;      ///< service clock at the flight's time 0: a host up for 1000 s
inline constexpr std::int64_t kGpsStart_ns = 1'400'000'000'000'000'000;  ///< GPS time of the same instant
inline constexpr std::int64_t kCameraStart_ns = 77'000'000'000;          ///< camera clock of the same instant
inline constexpr double kTail_s = 0.3;                                   ///< TSPI goes on after the frames

[[nodiscard]] inline std::int64_t to_ns(double s) { return static_cast<std::int64_t>(std::llround(s * 1e9)); }

/// Where a mount and a lens put the camera.
struct CameraPlace {
  Rotation<frame::C, frame::R> R_c_r{};
  Vec3 lens_in_receiver_m{0, 0, 0};
};

class FlightScene {
 public:
  /// Errors: of the scenario's files; kInvalid with the time when its geometry cannot be: nose or lens in or nearer than
  /// 0.5 m to the tanker, or a tanker that is in no frame.
  static Result<std::unique_ptr<FlightScene>> load(const Scenario& scenario);

  /// Start and middle of an exposure. The camera keeps its rate by its own clock.
  [[nodiscard]] double start_s(int frame) const;
  [[nodiscard]] double mid_s(int frame) const { return start_s(frame) + 0.5e-6 * scenario.exposure_us; }
  [[nodiscard]] std::int64_t mid_ns(int frame) const;  ///< service clock
  [[nodiscard]] Pose<frame::C, frame::M> camera_from_model(const Pose<frame::R, frame::K>& T_r_k, const CameraPlace& place) const;
  [[nodiscard]] View view(int frame) const;
  /// True range of the scenario's definition at a frame: reference point to nose, ft.
  [[nodiscard]] double range_ft(int frame) const;

  const Scenario scenario;
  const TankerModel model;
  const Camera camera;
  const Mesh mesh;
  const Motion motion;
  const CameraPlace true_place;

  /// Made at the first call: sky and light of the mesh take a second or two.
  [[nodiscard]] const Renderer& renderer() const;

 private:
  FlightScene(const Scenario& s, TankerModel model, Camera camera, Mesh mesh);
  [[nodiscard]] Result<> check() const;
  mutable std::once_flag first_use_;
  mutable std::unique_ptr<const Renderer> renderer_;
};

}  // namespace cyclops::hil
