#pragma once
/// A painted square plate before the camera, every pixel the mean of exact rays.
///
/// The plate is the plane x = 0 of the model, 4 m a side; its corners are features 1 to 4, features 5 and 6 lie inside.
/// `paint` gives counts at (y right, z up) on the plate, `ground` those beside it at raw pixels.
#include <functional>
#include <vector>

#include "geometry/camera.hpp"
#include "geometry/tanker_model.hpp"
#include "msg/chain.hpp"
#include "msg/frame.hpp"
#include "test/support.hpp"

namespace cyclops::test {

using Paint = std::function<double(double, double)>;
using CameraPose = Pose<frame::C, frame::K>;

class Plate {
 public:
  Plate() : model(TankerModel::parse("id,x,y,z,sigma\n1,0,-2,2,0\n2,0,2,2,0\n3,0,2,-2,0\n4,0,-2,-2,0\n5,0,0.3,0.5,0\n6,0,-0.7,-0.6,0\n", "plate", 1, Vec3::Zero()).value()) {
    Intrinsics k;
    k.width = 320;
    k.height = 240;
    k.fx_px = k.fy_px = 300;
    k.cx_px = 159.5;
    k.cy_px = 119.5;
    camera = Camera(k, {});
  }

  /// Camera from tanker body: `turn` is a rotation vector in camera axes, `where` the plate's middle, m.
  [[nodiscard]] static CameraPose pose(const Vec3& turn, const Vec3& where) {
    const auto level = camera_from_receiver({}).quaternion();
    return {Rotation<frame::C, frame::K>(so3_exp(turn) * level), Point<frame::C>(where)};
  }

  ImageView draw(const CameraPose& T, const Paint& paint, const Paint& ground, std::uint64_t seed) {
    constexpr int kSub = 4;
    Random random(seed);
    std::normal_distribution<double> noise(0, 1.0);
    const Pose<frame::K, frame::C> back = T.inverse();
    const Vec3 eye = (back * Point<frame::C>()).xyz;
    const Intrinsics& k = camera.intrinsics();
    pixels.resize(static_cast<std::size_t>(k.width * k.height));
    for (int v = 0; v < k.height; ++v)
      for (int u = 0; u < k.width; ++u) {
        double sum = 0;
        for (int i = 0; i < kSub * kSub; ++i) {
          const double ur = u + (i % kSub + 0.5) / kSub - 0.5, vr = v + (i / kSub + 0.5) / kSub - 0.5;
          const Vec3 ray = back.rotation().rotate(Vec3((ur - k.cx_px) / k.fx_px, (vr - k.cy_px) / k.fy_px, 1));
          const Vec3 hit = eye - eye.x() / ray.x() * ray;
          const double y = hit.y(), z = -hit.z();
          sum += std::fabs(y) < 2 && std::fabs(z) < 2 ? paint(y, z) : ground(ur, vr);
        }
        pixels[static_cast<std::size_t>(v * k.width + u)] = static_cast<std::uint8_t>(std::clamp(std::lround(sum / (kSub * kSub) + noise(random)), 0L, 255L));
      }
    return {pixels.data(), k.width, k.height, k.width, PixelFormat::kMono8};
  }

  /// All features at `T`, with `sigma_px` an axis.
  void predict(const CameraPose& T, double sigma_px, PredictionSet& out) const {
    out.items.clear();
    for (std::size_t i = 0; i < model.features().size(); ++i) {
      Prediction p;
      p.id = model.features()[i].id;
      p.feature = static_cast<std::uint16_t>(i);
      p.visibility = Visibility::kVisible;
      p.uv_px = at(T, i);
      p.cov_px2 = sigma_px * sigma_px * Mat2::Identity();
      out.items.push_back(p);
    }
  }
  [[nodiscard]] Vec2 at(const CameraPose& T, std::size_t feature) const { return *camera.project(T * model.in_body(model.features()[feature])); }

  TankerModel model;
  Camera camera;
  std::vector<std::uint8_t> pixels;
};

}  // namespace cyclops::test
