// sources: src/base src/monitor src/geometry src/service/rig.cpp src/service/profile.cpp src/capture/strobe_*.cpp src/capture/gpio_error.cpp src/capture/camera_config.cpp src/timesync src/nav src/estimate src/segment src/detect src/align src/edge/edge_config.cpp src/patch/patch_config.cpp src/patch/looks.cpp src/associate src/track src/publish
// Any bytes as a file an operator can put in front of the service: the first byte says which, the rest is the file.
// What is accepted must be fit for use: the model is projected through the camera and back.
#include <cmath>

#include "monitor/limits.hpp"
#include "service/profile.hpp"
#include "service/rig.hpp"
#include "test/fuzz/memory_file.hpp"

using namespace cyclops;  // NOLINT

namespace {

void must(bool good) {
  if (!good) std::abort();
}

void use(const TankerModel& model, const Camera& camera) {
  for (const Feature& f : model.features()) {
    must(f.p_m.xyz.allFinite() && model.in_body(f).xyz.allFinite() && std::isfinite(f.sigma_m) && f.sigma_m >= 0);
    for (const Vec3& n : f.normals_m) must(std::fabs(n.norm() - 1) < 1e-6);
    const Point<frame::C> p(f.p_m.xyz + Vec3(0, 0, 20));
    Eigen::Matrix<double, 2, 3> jacobian;
    if (const auto uv = camera.project(p, jacobian)) {
      must(uv->allFinite() && jacobian.allFinite());
      if (camera.inside(*uv)) (void)camera.z_point_m(camera.ideal_from_raw(*uv));
    }
  }
}

void try_looks(const std::string& text) {
  static const TankerModel one = TankerModel::parse("id,x,y,z\n1,0,0,0\n2,1,2,3\n", "one", 1, Vec3::Zero()).value();
  const auto looks = Looks::parse(text, "looks", one);
  if (!looks.ok()) return must(!looks.error().message().empty());
  for (const Look& l : looks->items) {
    must(l.feature < 2 && (l.patch.T_c_k * l.p_k).xyz.allFinite() && l.patch.step_m > 0 && l.patch.then_px.allFinite() && l.matched <= l.tried);
    for (const float x : l.patch.store) must(x >= 0 && x <= 255);
  }
}

void try_limits(const std::string& text) {
  const auto limits = Limits::parse(text, "alarms");
  if (!limits.ok()) return must(!limits.error().message().empty());
  for (const Limit& limit : limits->items) must(limit.quantity != nullptr && !limit.name.empty() && (limit.above ? limit.clear <= limit.limit : limit.clear >= limit.limit));
}

void try_windscreen(const std::string& path) {
  const auto screen = Windscreen::load(path);
  if (!screen.ok()) return must(!screen.error().what.empty());
  for (const double u : {-1e9, 0.0, 0.5, 100.25, 1e9}) {
    must(screen->delta({u, -u}).allFinite());
    (void)screen->undistort({u, 3});
    (void)screen->delta_jacobian({u, 3});
  }
}

void try_rig(const std::string& path) {
  static const TankerModel one = TankerModel::parse("id,x,y,z\n1,0,0,0\n2,1,2,3\n", "one", 1, Vec3::Zero()).value();
  const auto rig = Rig::load(path);
  if (!rig.ok()) return must(!rig.error().message().empty());
  must(rig->stamper.validated().ok());
  must(rig->device.period().ns > 0 && rig->lens.xyz.allFinite());
  (void)validated(rig->device).ok();
  use(rig->tanker, rig->camera);
  use(one, rig->camera);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static fuzz::MemoryFile file("config");
  const std::string text(reinterpret_cast<const char*>(data + 1), size - 1);
  // A rig may name any file of the machine: here only a tanker that is there, so that devices are left alone.
  if (text.find("/dev") != std::string::npos || text.find("..") != std::string::npos) return 0;
  const std::string& path = file.holding(data + 1, size - 1);
  switch (data[0] % 5) {
    case 0: try_limits(text); break;
    case 1:
      if (const auto profile = Profile::load(path); profile.ok()) must(profile->nav.validated().ok());
      break;
    case 2: try_rig(path); break;
    case 3:
      if (text.starts_with("cyclops-looks")) try_looks(text);
      else if (const auto model = TankerModel::parse(text, "tanker", 0.0254, {190, 0, 95}); model.ok()) use(*model, Camera({}, {}));
      break;
    default: try_windscreen(path);
  }
  return 0;
}
