#include "hil/render.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/optics.hpp"
#include "hil/render_rays.hpp"
#include "hil/sensor.hpp"
#include "hil/sky.hpp"

namespace cyclops::hil {
namespace {

constexpr double kLift_m = 0.12 * 0.0254;   // a feature lies in the skin
constexpr double kFacing = 0.02;            // cosine above which a surface faces the camera
constexpr double kGrazingCosine = 0.026;          // below this cosine, 1.5 deg, it hardly does
constexpr double kBorder_px = 3;
constexpr double kWidest = 1.4, kNarrowest = 16;  // f-numbers of the lens
constexpr double kAim = 0.85;               // of full well: the brighter of horizon sky and half-lit white paint

double set_by_hand(const Look& look, const Sky& sky) {
  double brightest = 0.7 * 0.78 / std::numbers::pi * (sky.sun_lx() * 0.55 + sky.irradiance({0, 0, -1}));
  const double around = std::atan2(sky.to_sun_n().y(), sky.to_sun_n().x());
  double mean = 0;
  for (int k = 0; k < 24; ++k) {  // the sky at 12 deg elevation, the third around the sun left out
    const double a = around + std::numbers::pi / 3 + k * (4 * std::numbers::pi / 3) / 23;
    mean += sky.smooth({0.978 * std::cos(a), 0.978 * std::sin(a), -0.208}) / 24;
  }
  brightest = std::max(brightest, 1.6 * mean);
  const double e = brightest * look.sensor.responsivity * look.sensor.exposure_us * 1e-6;
  return std::clamp(std::sqrt(e / (kAim * look.sensor.full_well_e)), kWidest, kNarrowest);
}

/// kSaturated and kBlownOut: some or all of the 3 x 3 pixels about a place within the image.
std::uint32_t saturation(const std::vector<std::uint16_t>& image, const Intrinsics& k, const Vec2& uv, int count) {
  const int u0 = static_cast<int>(std::lround(uv.x())), v0 = static_cast<int>(std::lround(uv.y()));
  bool some = false, all = true;
  for (int v = std::max(v0 - 1, 0); v <= std::min(v0 + 1, k.height - 1); ++v)
    for (int u = std::max(u0 - 1, 0); u <= std::min(u0 + 1, k.width - 1); ++u) {
      const bool full = image[static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width) + static_cast<std::size_t>(u)] >= count;
      some |= full, all &= full;
    }
  return (some ? kSaturated : 0U) | (some && all ? kBlownOut : 0U);
}

}  // namespace

Renderer::Renderer(Camera camera, Mesh mesh, const Look& look, std::uint64_t seed) : camera_(std::move(camera)), look_(look), seed_(seed), sky_(std::make_unique<Sky>(look, seed)) {
  if (look_.optics.automatic_f_number) look_.optics.f_number = set_by_hand(look_, *sky_);
  rays_ = std::make_unique<RayScene>(camera_, std::move(mesh), look_, seed);
}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

void Renderer::draw(const View& view, Drawing what, std::vector<float>& out) const {
  const Intrinsics& k = camera_.intrinsics();
  if (what == Drawing::kLight) sky_->paint(rays_->directions(), k.width, k.height, view.R_n_c, out);
  else out.assign(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height), 0.F);
  rays_->trace(view, *sky_, what, out);
}

void Renderer::render(const View& view, std::vector<std::uint16_t>& out) const {
  const Intrinsics& k = camera_.intrinsics();
  std::vector<float> image;
  draw(view, Drawing::kLight, image);
  through_lens(look_.optics, k.width, k.height, k.fx_px, image);
  expose(look_, k.width, k.height, seed_, view.frame, image, out);
}

std::optional<Vec2> Renderer::project(const Point<frame::C>& p) const {
  auto uv = camera_.project(p);
  for (int i = 0; i < 6 && uv && look_.optics.windscreen_parallax_mm > 0; ++i) uv = camera_.project(Point<frame::C>(p.xyz - rays_->start(*uv)));
  return uv;
}

std::vector<FeatureTruth> Renderer::truth(const View& view, const TankerModel& model, const std::vector<std::uint16_t>* image) const {
  const Intrinsics& k = camera_.intrinsics();
  const Vec3 eye = view.T_c_m.inverse().translation().xyz, to_sun = view.R_n_m.transpose() * sky_->to_sun_n();
  const int saturated = saturated_count(look_.sensor);
  std::vector<FeatureTruth> out;
  for (const Feature& f : model.features()) {
    FeatureTruth t;
    t.id = f.id;
    const Point<frame::C> p = view.T_c_m * f.p_m;
    const auto uv = project(p);
    if (!uv) { out.push_back(t); continue; }
    t.in_front = true;
    t.raw_px = *uv;
    t.ideal_px = camera_.project_ideal(p).value();  // in front, or there were no uv
    const Vec3 to_eye = (eye - f.p_m.xyz).normalized();
    double best = f.normals_m.empty() ? 1 : -1, sun = -1;
    Vec3 face = to_eye;
    for (const Vec3& n : f.normals_m) {
      if (n.dot(to_eye) > best) best = n.dot(to_eye), face = n;
      if (n.dot(to_eye) > 0) sun = std::max(sun, n.dot(to_sun));
    }
    const Vec3 out_of_skin = (face + to_eye).normalized();
    const auto free = [&](double lift) { return rays_->free(f.p_m.xyz + lift * out_of_skin, eye, 0.05); };
    const bool inside = camera_.inside(*uv), seen = free(kLift_m), lifted_free = free(4 * kLift_m);
    const double border = std::min({uv->x(), uv->y(), k.width - 1 - uv->x(), k.height - 1 - uv->y()});
    const auto say = [&](bool yes, Reason r) { t.reasons |= yes ? r : 0U; };
    say(!inside, kOutOfField);
    say(best <= kFacing, kFacesAway);
    say(!seen, kOccluded);
    say(inside && border < kBorder_px, kAtBorder);
    say(best > 0 && best < kGrazingCosine, kGrazing);
    say(best > 0 && seen != lifted_free, kHalfHidden);
    say(!f.normals_m.empty() && (sun <= 0 || !rays_->free(f.p_m.xyz + kLift_m * out_of_skin, f.p_m.xyz + 100 * to_sun, 0)), kInShadow);
    if (image != nullptr && inside) t.reasons |= saturation(*image, k, *uv, saturated);
    t.visible = inside && best > kFacing && seen;
    t.doubtful = inside && ((best > 0 && best < kGrazingCosine && seen) || (best > kFacing && seen != lifted_free) || (t.visible && (border < kBorder_px || (t.reasons & kBlownOut) != 0)));
    out.push_back(t);
  }
  return out;
}

}  // namespace cyclops::hil
