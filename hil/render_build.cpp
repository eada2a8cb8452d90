// What is made once: ray table, Embree scenes, seams between materials, ambient occlusion.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <thread>
#include <tuple>

#include "hil/made_up_windscreen.hpp"
#include "hil/render_rays.hpp"

namespace cyclops::hil {
namespace {

constexpr int kOpenRays = 40;
constexpr float kOpenReach_m = 6, kLift_m = 0.004F;

std::tuple<long, long, long> rounded(const Vec3& p, double step) { return {std::lround(p.x() / step), std::lround(p.y() / step), std::lround(p.z() / step)}; }

RTCScene scene_of(RTCDevice device, const std::vector<Eigen::Vector3f>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
  if (!triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* p = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) std::copy(points[i].data(), points[i].data() + 3, p + 3 * i);
    auto* t = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles.size()));
    for (std::size_t i = 0; i < triangles.size(); ++i) std::copy(triangles[i].begin(), triangles[i].end(), t + 3 * i);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene);
  return scene;
}

/// Directions about z, evenly spread and weighted by the cosine; the same for every point, so that neighbours agree.
std::vector<Eigen::Vector3f> cosine_directions() {
  std::vector<Eigen::Vector3f> out;
  for (int i = 0; i < kOpenRays; ++i) {
    const double r2 = (i + 0.5) / kOpenRays, a = i * 2.399963229728653;
    out.emplace_back(static_cast<float>(std::sqrt(r2) * std::cos(a)), static_cast<float>(std::sqrt(r2) * std::sin(a)), static_cast<float>(std::sqrt(1 - r2)));
  }
  return out;
}

}  // namespace

RayScene::RayScene(const Camera& camera, Mesh mesh, const Look& look, std::uint64_t seed)
    : camera_(camera), mesh_(std::move(mesh)), look_(look), seed_(seed), width_(camera.intrinsics().width), height_(camera.intrinsics().height) {
  const Intrinsics& k = camera_.intrinsics();
  directions_.reserve(static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(height_ + 1));
  for (int v = 0; v <= height_; ++v)
    for (int u = 0; u <= width_; ++u) {
      const Vec2 q = camera_.ideal_from_raw({u - 0.5, v - 0.5});
      directions_.emplace_back(static_cast<float>((q.x() - k.cx_px) / k.fx_px), static_cast<float>((q.y() - k.cy_px) / k.fy_px));
    }
  build();
}

RayScene::~RayScene() {
  rtcReleaseScene(scene_);
  rtcReleaseScene(occluders_);
  rtcReleaseDevice(device_);
}

void RayScene::build() {
  weld();
  find_seams();
  device_ = rtcNewDevice("threads=1,isa=avx2");
  scene_ = scene_of(device_, points_, index_);
  std::vector<std::array<std::uint32_t, 3>> shading;
  for (std::size_t i = 0; i < index_.size(); ++i)
    if (mesh_.materials[mesh_.triangles[i].material].shades) shading.push_back(index_[i]);
  occluders_ = scene_of(device_, points_, shading);
  bake();
}

void RayScene::weld() {
  std::map<std::tuple<long, long, long>, std::uint32_t> seen;
  std::vector<std::uint32_t> to(mesh_.vertices_m.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    const auto [at, fresh] = seen.try_emplace(rounded(mesh_.vertices_m[i], 1e-6), static_cast<std::uint32_t>(points_.size()));
    if (fresh) points_.push_back(mesh_.vertices_m[i].cast<float>());
    to[i] = at->second;
  }
  for (const Triangle& t : mesh_.triangles) {
    index_.push_back({to[t.vertex[0]], to[t.vertex[1]], to[t.vertex[2]]});
    const Vec3 &a = mesh_.vertices_m[t.vertex[0]], &b = mesh_.vertices_m[t.vertex[1]], &c = mesh_.vertices_m[t.vertex[2]];
    flat_.push_back((b - a).cross(c - a).cast<float>());
  }
}

void RayScene::find_seams() {
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> first;  // edge -> material, or kMixed
  constexpr std::uint32_t kMixed = 1 << 20;
  for (std::size_t i = 0; i < index_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = index_[i][k], b = index_[i][(k + 1) % 3], m = mesh_.triangles[i].material;
      const auto [at, fresh] = first.try_emplace({std::min(a, b), std::max(a, b)}, m);
      if (fresh || at->second == m || at->second == kMixed) continue;
      at->second = kMixed;
      seams_.push_back(at->first);
    }
}

float RayScene::openness(const Eigen::Vector3f& p, const Eigen::Vector3f& n) const {
  static const std::vector<Eigen::Vector3f> directions = cosine_directions();
  const Eigen::Vector3f side = (std::fabs(n.x()) > 0.9F ? Eigen::Vector3f::UnitY() : Eigen::Vector3f::UnitX()).cross(n).normalized(), other = n.cross(side);
  int open = 0;
  for (const Eigen::Vector3f& d : directions) {
    const Eigen::Vector3f w = side * d.x() + other * d.y() + n * d.z(), o = p + kLift_m * n;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray{o.x(), o.y(), o.z(), 0.01F, w.x(), w.y(), w.z(), 0, kOpenReach_m, 0xFFFFFFFF, 0, 0};
    rtcOccluded1(occluders_, &context, &ray);
    open += ray.tfar >= 0;
  }
  return static_cast<float>(open) / kOpenRays;
}

void RayScene::bake() {
  struct Place { Eigen::Vector3f p, n; std::array<float, 2> open; };
  std::vector<Place> places;
  std::map<std::tuple<std::uint32_t, long, long, long>, std::uint32_t> seen;
  std::vector<std::array<std::uint32_t, 3>> at(index_.size());
  corners_.resize(index_.size());
  for (std::size_t i = 0; i < index_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      corners_[i][k].normal = mesh_.triangles[i].normal[k].cast<float>();
      const auto [x, y, z] = rounded(mesh_.triangles[i].normal[k], 0.02);
      const auto [it, fresh] = seen.try_emplace({index_[i][k], x, y, z}, static_cast<std::uint32_t>(places.size()));
      if (fresh) places.push_back({points_[index_[i][k]], corners_[i][k].normal, {1, 1}});
      at[i][k] = it->second;
    }
  if (look_.light.uniform_cdm2 < 0) {
    const auto work = [&](std::size_t first) {
      for (std::size_t i = first; i < places.size(); i += 2) places[i].open = {openness(places[i].p, places[i].n), openness(places[i].p, -places[i].n)};
    };
    std::thread other(work, 1);
    work(0);
    other.join();
  }
  for (std::size_t i = 0; i < index_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) std::copy_n(places[at[i][k]].open.begin(), 2, corners_[i][k].open);
}

bool RayScene::free(const Vec3& from, const Vec3& to, double free_end_m) const {
  const Eigen::Vector3f o = from.cast<float>(), d = (to - from).normalized().cast<float>();
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray{o.x(), o.y(), o.z(), 0, d.x(), d.y(), d.z(), 0, static_cast<float>((to - from).norm() - free_end_m), 0xFFFFFFFF, 0, 0};
  rtcOccluded1(scene_, &context, &ray);
  return ray.tfar >= 0;
}

Vec3 RayScene::start(const Vec2& raw) const {
  const Vec2 aside = windscreen_parallax_m(raw, width_, height_, look_.optics.windscreen_parallax_mm);
  return {aside.x(), aside.y(), 0};
}

}  // namespace cyclops::hil
