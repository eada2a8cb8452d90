#include "hil/sky.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <thread>

#include "hil/noise.hpp"

namespace cyclops::hil {
namespace {

constexpr double kPi = std::numbers::pi, kDeg = kPi / 180;
constexpr double kStep_deg = 0.15, kLowest_deg = -45, kHighest_deg = 85;
constexpr int kColumns = 2400, kRows = 867;  // 360 and 130 deg in steps of 0.15
constexpr double kSunRadius = 0.2665 * kDeg, kSunSolidAngle_sr = 6.8e-5;
constexpr int kGrid = 4;  // px between points whose direction is worked out

double smoothstep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

double elevation_of(const Vec3& d) { return std::asin(std::clamp(-d.z(), -1.0, 1.0)); }

Vec3 direction(double azimuth, double elevation) { return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), -std::sin(elevation)}; }

std::array<double, 9> basis(const Vec3& d) {
  const double x = d.x(), y = d.y(), z = d.z();
  return {0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z, 0.315392 * (3 * z * z - 1), 1.092548 * x * z, 0.546274 * (x * x - y * y)};
}

}  // namespace

Sky::Sky(const Look& look, std::uint64_t seed) : look_(look), to_sun_(look.light.to_sun_n()) {
  const double h_deg = look.light.sun_elevation_deg, h = std::max(h_deg, 0.5) * kDeg;
  day_ = smoothstep(-2, 1, h_deg);
  zenith_ = 0.8 * (300 + 3000 * std::tan(std::min(h, 75 * kDeg)));
  twilight_ = std::max(150 * std::exp(0.85 * (std::min(h_deg, 0.0) + 4)), 0.0) * (1 - day_) + 1e-4;
  sun_lx_ = h_deg > -0.27 ? 98e3 * std::exp(-0.21 / (std::sin(h) + 0.025)) * smoothstep(-0.27, 0.5, h_deg) : 0;
  disc_ = sun_lx_ / kSunSolidAngle_sr;
  if (look.sky.cloud_cover > 0 && sun_lx_ > 0) {
    double light = 0;
    sun_lx_ *= 1 - 0.95 * cloud_opacity(std::atan2(to_sun_.y(), to_sun_.x()), h, seed, light);
    disc_ = sun_lx_ / kSunSolidAngle_sr;
  }
  ground_ = look.sky.ground_albedo * (sun_lx_ * std::max(std::sin(h_deg * kDeg), 0.0) + day_ * 3.2 * zenith_ + 1.2 * twilight_) / kPi;
  constexpr int kAround = 72, kUp = 36;
  for (int i = 0; i < kUp; ++i)
    for (int j = 0; j < kAround; ++j) {
      const double low = -0.5 * kPi + kPi * i / kUp, high = low + kPi / kUp;
      const Vec3 d = direction(2 * kPi * (j + 0.5) / kAround, 0.5 * (low + high));
      const double part = smooth(d) * (std::sin(high) - std::sin(low)) * 2 * kPi / kAround;
      const auto b = basis(d);
      for (std::size_t k = 0; k < 9; ++k) harmonics_[k] += part * b[k];
    }
  constexpr double kCosine[9] = {kPi, 2 * kPi / 3, 2 * kPi / 3, 2 * kPi / 3, kPi / 4, kPi / 4, kPi / 4, kPi / 4, kPi / 4};
  for (std::size_t k = 0; k < 9; ++k) harmonics_[k] *= kCosine[k];
  if (look.sky.uniform_cdm2 < 0) draw_panorama(seed);
}

double Sky::irradiance(const Vec3& n) const {
  const auto b = basis(n);
  double sum = 0;
  for (std::size_t k = 0; k < 9; ++k) sum += harmonics_[k] * b[k];
  return std::max(sum, 0.0);
}

double Sky::aureole(double cos_gamma) const {
  const double g = std::acos(std::clamp(cos_gamma, -1.0, 1.0)) / kDeg;
  return 0.02 * sun_lx_ * (std::exp(-g / 3) + 0.12 * std::exp(-g / 11));
}

double Sky::clear(const Vec3& d, double elevation) const {
  const double cos_g = d.dot(to_sun_), g = std::acos(std::clamp(cos_g, -1.0, 1.0)), zs = kPi / 2 - std::max(look_.light.sun_elevation_deg, 0.5) * kDeg;
  const double up = std::max(elevation, 0.2 * kDeg);
  double l = 0;
  if (day_ > 0) {
    const double here = (0.91 + 10 * std::exp(-3 * g) + 0.45 * cos_g * cos_g) * (1 - std::exp(-0.32 / std::sin(up)));
    l += day_ * zenith_ * here / (0.274 * (0.91 + 10 * std::exp(-3 * zs) + 0.45 * std::cos(zs) * std::cos(zs)));
  }
  if (twilight_ > 0) {
    const double a = std::acos(std::clamp(std::cos(std::atan2(d.y(), d.x()) - std::atan2(to_sun_.y(), to_sun_.x())), -1.0, 1.0)), e = up / kDeg;
    l += twilight_ * (0.35 * std::exp(-e / 40) + std::exp(-e / 9) * (0.25 + 0.75 * std::exp(-a * a / 1.125)));
  }
  return l;
}

double Sky::smooth(const Vec3& d) const {
  const double e = elevation_of(d);
  if (look_.sky.uniform_cdm2 >= 0) return look_.sky.uniform_cdm2;
  if (e >= 0) {
    const double veil = 0.35 * look_.sky.cloud_cover;  // clouds on average
    return (1 - veil) * clear(d, e) + veil * (0.5 * ground_ / std::max(look_.sky.ground_albedo, 0.05));
  }
  const double share = std::exp(e / (look_.sky.haze_deg * kDeg));
  return ground_ + share * (clear(Vec3(d.x(), d.y(), 0).normalized(), 0) - ground_);
}

double Sky::cloud_opacity(double azimuth, double elevation, std::uint64_t seed, double& light) const {
  // Layers seen from below: finer towards the horizon.
  const double up = std::log(elevation / kDeg + 4), x0 = azimuth * 2.6 + 11, y0 = 3.4 * up;
  const auto density = [&](double x, double y, int octaves) {
    const double wx = fbm(1.3 * x + 5, 1.3 * y, 3, seed + 31) - 0.5, wy = fbm(1.3 * x - 7, 1.3 * y + 3, 3, seed + 53) - 0.5;
    const double billow = std::fabs(2 * fbm(3.1 * x, 3.1 * y, 3, seed + 71) - 1);
    return fbm(x + 0.9 * wx, y + 0.9 * wy, octaves, seed + 17) + 0.16 * (0.35 - billow);
  };
  const double n = density(x0, y0, 7), threshold = 0.58 - 0.20 * look_.sky.cloud_cover;
  const double opacity = smoothstep(0, 1, (n - threshold) / 0.16) * smoothstep(0, 0.02, look_.sky.cloud_cover);
  if (opacity <= 0) return 0;
  const double da = std::sin(std::atan2(to_sun_.y(), to_sun_.x()) - azimuth), de = elevation_of(to_sun_) - elevation;
  const double far = std::max(std::hypot(da, de), 1e-3), step = 0.12;
  const double towards = density(x0 + step * da / far, y0 + 0.7 * step * de / far, 5);
  const double edge = std::clamp(3.5 * (n - towards), -0.5, 0.6), core = smoothstep(0.08, 0.32, n - threshold);
  light = std::clamp(0.62 + look_.sky.cloud_contrast * (0.75 * edge - 0.30 * core + 0.12), 0.05, 1.6);
  return opacity * (1 - 0.7 * std::exp(-elevation / (2.5 * kDeg)));
}

float Sky::textured(double azimuth, double elevation, std::uint64_t seed) const {
  const Vec3 d = direction(azimuth, elevation);
  if (elevation >= 0) {
    const double blue = clear(d, elevation);
    if (look_.sky.cloud_cover <= 0) return static_cast<float>(blue);
    double light = 0;
    const double opacity = cloud_opacity(azimuth, elevation, seed, light);
    const double white = 0.75 * (98e3 * std::exp(-0.21 / (std::max(std::sin(look_.light.sun_elevation_deg * kDeg), 0.0) + 0.025)) * day_ * 0.45 + 3.2 * day_ * zenith_ + 3 * twilight_) / kPi;
    return static_cast<float>(blue + opacity * (white * light - blue));
  }
  const double far = 1 / std::max(std::sin(-elevation), 0.004);
  const double x = far * std::cos(azimuth), y = far * std::sin(azimuth);
  const double patch = 0.65 * (fbm(0.9 * x, 0.9 * y, 5, seed + 97) - 0.5) + 0.5 * (fbm(0.13 * x + 9, 0.13 * y, 3, seed + 113) - 0.5);
  const double fade = std::exp(-1.2 * kDeg / -elevation);  // detail finer than the haze lets through
  const double ground = ground_ * std::max(0.15, 1 + 3.2 * look_.sky.ground_contrast * fade * patch);
  const double horizon = clear(direction(azimuth, 0), 0), share = std::exp(elevation / (look_.sky.haze_deg * kDeg));
  return static_cast<float>(ground + share * (horizon - ground));
}

void Sky::draw_panorama(std::uint64_t seed) {
  panorama_.resize(static_cast<std::size_t>(kRows) * kColumns);
  const auto rows = [&](int first, int step) {
    for (int i = first; i < kRows; i += step)
      for (int j = 0; j < kColumns; ++j)
        panorama_[static_cast<std::size_t>(i) * kColumns + static_cast<std::size_t>(j)] = textured((-180 + j * kStep_deg) * kDeg, (kLowest_deg + i * kStep_deg) * kDeg, seed);
    // The noise does not close around the circle: its last 24 deg fade into what comes before its first.
    constexpr int kFade = 160;
    for (int i = first; i < kRows; i += step)
      for (int k = 0; k < kFade; ++k) {
        float& p = panorama_[static_cast<std::size_t>(i) * kColumns + static_cast<std::size_t>(kColumns - kFade + k)];
        p += static_cast<float>(smoothstep(0, kFade, k + 1)) * (textured((-180 - (kFade - k) * kStep_deg) * kDeg, (kLowest_deg + i * kStep_deg) * kDeg, seed) - p);
      }
  };
  std::thread other(rows, 1, 2);
  rows(0, 2);
  other.join();
}

void Sky::paint(const std::vector<Eigen::Vector2f>& rays, int width, int height, const Mat3& R_n_c, std::vector<float>& image) const {
  image.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), static_cast<float>(std::max(look_.sky.uniform_cdm2, 0.0)));
  if (look_.sky.uniform_cdm2 >= 0) return;
  const int nu = (width + kGrid - 1) / kGrid + 1, nv = (height + kGrid - 1) / kGrid + 1;
  struct Node { float x, y, glow, cos_g; };
  std::vector<Node> nodes(static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv));
  const auto ray = [&](int u, int v) { return rays[static_cast<std::size_t>(std::min(v, height)) * static_cast<std::size_t>(width + 1) + static_cast<std::size_t>(std::min(u, width))]; };
  const Vec3 ahead = R_n_c.col(2);
  const double middle = std::atan2(ahead.y(), ahead.x());
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const Eigen::Vector2f r = ray(i * kGrid, j * kGrid);
      const Vec3 d = (R_n_c * Vec3(r.x(), r.y(), 1)).normalized();
      const double a = middle + std::remainder(std::atan2(d.y(), d.x()) - middle, 2 * kPi), cos_g = d.dot(to_sun_);
      nodes[static_cast<std::size_t>(j * nu + i)] = {static_cast<float>((a / kDeg + 540) / kStep_deg), static_cast<float>((elevation_of(d) / kDeg - kLowest_deg) / kStep_deg),
                                                     sun_lx_ > 0 && cos_g > 0.4 ? static_cast<float>(aureole(cos_g)) : 0.F, static_cast<float>(cos_g)};
    }
  const float top = kRows - 1.001F;
  for (int v = 0; v < height; ++v) {
    const float fv = (static_cast<float>(v % kGrid) + 0.5F) / kGrid;
    const Node *low = &nodes[static_cast<std::size_t>(v / kGrid * nu)], *high = low + nu;
    float* out = &image[static_cast<std::size_t>(v) * static_cast<std::size_t>(width)];
    for (int i = 0; i * kGrid < width; ++i) {
      const auto mix = [&](float Node::*m, float fu) { return (low[i].*m * (1 - fu) + low[i + 1].*m * fu) * (1 - fv) + (high[i].*m * (1 - fu) + high[i + 1].*m * fu) * fv; };
      for (int k = 0; k < kGrid && i * kGrid + k < width; ++k) {
        const float fu = (static_cast<float>(k) + 0.5F) / kGrid;
        const float x = mix(&Node::x, fu), y = std::clamp(mix(&Node::y, fu), 0.F, top);
        const int xi = static_cast<int>(x), yi = static_cast<int>(y);
        const float a = x - static_cast<float>(xi), b = y - static_cast<float>(yi);
        const int j0 = xi % kColumns, j1 = j0 + 1 == kColumns ? 0 : j0 + 1;
        const float *p = &panorama_[static_cast<std::size_t>(yi) * kColumns], *q = p + kColumns;
        out[i * kGrid + k] = (p[j0] * (1 - a) + p[j1] * a) * (1 - b) + (q[j0] * (1 - a) + q[j1] * a) * b + mix(&Node::glow, fu);
      }
    }
  }
  if (disc_ <= 0) return;
  const Vec3 sun_c = R_n_c.transpose() * to_sun_;
  if (sun_c.z() < 0.3) return;
  const double edge = 0.5 * (static_cast<double>(ray(width / 2 + 1, height / 2).x()) - static_cast<double>(ray(width / 2, height / 2).x()));
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      if (nodes[static_cast<std::size_t>(v / kGrid * nu + u / kGrid)].cos_g < 0.9998F - 0.0006F) continue;
      const Eigen::Vector2f r = 0.25F * (ray(u, v) + ray(u + 1, v) + ray(u, v + 1) + ray(u + 1, v + 1));
      const Vec3 d = Vec3(r.x(), r.y(), 1).normalized();
      const double g = d.cross(sun_c).norm();
      const double above = smoothstep(-0.1 * kDeg, 0.1 * kDeg, elevation_of(R_n_c * d));
      image[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)] += static_cast<float>(above * disc_ * (1 - smoothstep(kSunRadius - edge, kSunRadius + edge, g)));
    }
}

}  // namespace cyclops::hil
