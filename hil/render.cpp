#include "hil/render.hpp"

#include <algorithm>
#include <cmath>

#include "hil/noise.hpp"

namespace cyclops::hil {
namespace {

constexpr int kSkyStep = 8;              // pixels between points where the sky is worked out
constexpr double kOcclusion_m = 0.02;    // a surface this much nearer hides a feature
constexpr double kFacing = 0.02;         // cosine above which a surface faces the camera
constexpr double kGrazing = 0.026;       // below this cosine, 1.5 deg, it hardly does
constexpr double kBorder_px = 3;

}  // namespace

Renderer::Renderer(Camera camera, Mesh mesh, const Look& look, std::uint64_t seed) : camera_(std::move(camera)), mesh_(std::move(mesh)), look_(look), seed_(seed) {}

void Renderer::sky(const View& view, std::vector<float>& image) const {
  const int width = camera_.intrinsics().width, height = camera_.intrinsics().height;
  const int nu = width / kSkyStep + 2, nv = height / kSkyStep + 2;
  std::vector<float> coarse(static_cast<std::size_t>(nu * nv));
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const Vec3 ray = view.R_n_c * camera_.line_of_sight(camera_.ideal_from_raw(Vec2(i * kSkyStep, j * kSkyStep)));
      const double up = std::asin(std::clamp(-ray.z(), -1.0, 1.0)), around = std::atan2(ray.y(), ray.x());
      const double height_share = 1 - std::exp(-std::fabs(up) / 0.35);
      const double clear = look_.horizon + (look_.zenith - look_.horizon) * height_share * (up > 0 ? 1.0 : 0.5);
      const double stretch = 2.5 / (0.25 + std::fabs(std::sin(up)));  // flat layers: finer towards the horizon
      coarse[static_cast<std::size_t>(j * nu + i)] = static_cast<float>(clear + look_.cloud * (fbm(around * 6, up * 6 * stretch, 5, seed_) - 0.5));
    }
  for (int v = 0; v < height; ++v) {
    const int j = v / kSkyStep;
    const float b = static_cast<float>(v % kSkyStep) / kSkyStep;
    const float *low = &coarse[static_cast<std::size_t>(j * nu)], *high = low + nu;
    float* row = image.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
    for (int u = 0; u < width; ++u) {
      const int i = u / kSkyStep;
      const float a = static_cast<float>(u % kSkyStep) / kSkyStep;
      row[u] = (low[i] * (1 - a) + low[i + 1] * a) * (1 - b) + (high[i] * (1 - a) + high[i + 1] * a) * b;
    }
  }
}

void Renderer::blur(std::vector<float>& image) const {
  if (look_.blur_sigma_px <= 0) return;
  const int width = camera_.intrinsics().width, height = camera_.intrinsics().height;
  constexpr int kReach = 3;
  float tap[kReach + 1], sum = 0;
  for (int k = 0; k <= kReach; ++k) {
    tap[k] = static_cast<float>(std::exp(-0.5 * k * k / (look_.blur_sigma_px * look_.blur_sigma_px)));
    sum += k == 0 ? tap[k] : 2 * tap[k];
  }
  for (float& t : tap) t /= sum;
  std::vector<float> across(image.size());
  const auto n = static_cast<std::size_t>(width);
  std::vector<float> line(n + 2 * kReach);
  for (int v = 0; v < height; ++v) {
    const float* in = image.data() + static_cast<std::size_t>(v) * n;
    std::copy(in, in + n, line.begin() + kReach);
    for (int k = 0; k < kReach; ++k) { line[static_cast<std::size_t>(k)] = in[0]; line[n + kReach + static_cast<std::size_t>(k)] = in[n - 1]; }
    float* out = across.data() + static_cast<std::size_t>(v) * n;
    const float* l = line.data() + kReach;
    for (std::size_t u = 0; u < n; ++u) {
      float s = tap[0] * l[u];
      for (int k = 1; k <= kReach; ++k) s += tap[k] * (*(l + u - k) + l[u + static_cast<std::size_t>(k)]);
      out[u] = s;
    }
  }
  for (int v = 0; v < height; ++v) {
    float* out = image.data() + static_cast<std::size_t>(v) * n;
    const auto row = [&](int r) { return across.data() + static_cast<std::size_t>(std::clamp(r, 0, height - 1)) * n; };
    const float* r[2 * kReach + 1];
    for (int k = -kReach; k <= kReach; ++k) r[k + kReach] = row(v + k);
    for (std::size_t u = 0; u < n; ++u) {
      float s = tap[0] * r[kReach][u];
      for (int k = 1; k <= kReach; ++k) s += tap[k] * (r[kReach - k][u] + r[kReach + k][u]);
      out[u] = s;
    }
  }
}

void Renderer::expose(const View& view, const std::vector<float>& image, std::vector<std::uint16_t>& out) const {
  const float* table = normal_table();
  const std::uint64_t base = key(seed_, 0x5EED, view.frame);
  const auto gain = static_cast<float>(look_.electrons_per_count), read = static_cast<float>(look_.read_noise_e * look_.read_noise_e);
  const auto black = static_cast<float>(look_.black_level);
  out.resize(image.size());
  for (std::size_t i = 0; i < image.size(); i += 4) {
    const std::uint64_t bits = mixed(base + i);  // four pixels of 16 bits each
    for (std::size_t k = 0; k < 4 && i + k < image.size(); ++k) {
      const float electrons = std::max(image[i + k], 0.0F) * gain;
      const float noisy = electrons + std::sqrt(electrons + read) * table[bits >> (16 * k) & 0xFFFF];
      out[i + k] = static_cast<std::uint16_t>(std::clamp(noisy / gain + black + 0.5F, 0.0F, 4095.0F));
    }
  }
}

void Renderer::render(const View& view, std::vector<std::uint16_t>& out, double background) const {
  const int width = camera_.intrinsics().width, height = camera_.intrinsics().height;
  std::vector<float> image(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), static_cast<float>(background));
  if (background < 0) sky(view, image);
  rasterise(project_mesh(mesh_, camera_, view.T_c_m, view.R_n_m, look_.light), width, height, look_.columns, look_.rows, image);
  blur(image);
  expose(view, image, out);
}

std::vector<FeatureTruth> Renderer::truth(const View& view, const TankerModel& model) const {
  const auto triangles = project_mesh(mesh_, camera_, view.T_c_m, view.R_n_m, look_.light);
  std::vector<FeatureTruth> out;
  for (const Feature& f : model.features()) {
    FeatureTruth t;
    t.id = f.id;
    const Point<frame::C> p = view.T_c_m * f.p_m;
    if (const auto uv = camera_.project(p)) {
      t.raw_px = *uv;
      t.in_front = true;
      double best = f.normals_m.empty() ? 1 : -1;
      for (const Vec3& n : f.normals_m) best = std::max(best, -(view.T_c_m.rotation().rotate(n)).dot(p.xyz.normalized()));
      const bool in_view = camera_.inside(*uv);
      const auto free = [&](double margin_m) { return is_free(triangles, *uv, p.xyz.z(), margin_m); };
      t.visible = best > kFacing && in_view && free(kOcclusion_m);
      const double border = std::min({uv->x(), uv->y(), camera_.intrinsics().width - 1 - uv->x(), camera_.intrinsics().height - 1 - uv->y()});
      const bool grazing = best > 0 && best < kGrazing && free(kOcclusion_m);
      const bool half_hidden = best > kFacing && free(0.5 * kOcclusion_m) != free(2 * kOcclusion_m);
      t.doubtful = in_view && (grazing || half_hidden || (t.visible && border < kBorder_px));
    }
    out.push_back(t);
  }
  return out;
}

}  // namespace cyclops::hil
