#include "geometry/windscreen.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

namespace cyclops {
namespace {

constexpr char kMagic[8] = {'C', 'Y', 'C', 'W', 'I', 'N', 'D', '1'};
constexpr std::size_t kHead = 24;  // magic, rows, columns, step
constexpr int kMaxSide = 8192;

struct Cell {
  std::size_t at;
  double fu, fv;
};

}  // namespace

Result<Windscreen> Windscreen::from_grids(int rows, int cols, double step_px, std::vector<float> du, std::vector<float> dv) {
  const std::string name = "windscreen";
  if (rows < 2 || cols < 2 || rows > kMaxSide || cols > kMaxSide)
    return make_error(ErrorCode::kInvalid, name, "grid is " + std::to_string(rows) + " x " + std::to_string(cols) + ", expected 2 to 8192 a side");
  if (!(step_px > 0)) return make_error(ErrorCode::kInvalid, name, "grid step must be above 0 px");
  const auto n = static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols);
  if (du.size() != n || dv.size() != n) return make_error(ErrorCode::kInvalid, name, "grid has the wrong number of values");
  for (const auto* grid : {&du, &dv})
    for (float x : *grid)
      if (!std::isfinite(x)) return make_error(ErrorCode::kInvalid, name, "grid holds a value that is not finite");
  Windscreen w;
  w.rows_ = rows;
  w.cols_ = cols;
  w.step_ = step_px;
  w.du_ = std::move(du);
  w.dv_ = std::move(dv);
  return w;
}

Vec2 Windscreen::delta(const Vec2& uv) const {
  if (empty()) return Vec2::Zero();
  const double x = std::clamp(uv.x() / step_, 0.0, cols_ - 1.0);
  const double y = std::clamp(uv.y() / step_, 0.0, rows_ - 1.0);
  const int j = std::min(static_cast<int>(x), cols_ - 2);
  const int i = std::min(static_cast<int>(y), rows_ - 2);
  const double fx = x - j, fy = y - i;
  const std::size_t a = static_cast<std::size_t>(i) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(j);
  const std::size_t b = a + static_cast<std::size_t>(cols_);
  const auto mix = [&](const std::vector<float>& g) {
    return (1 - fy) * ((1 - fx) * g[a] + fx * g[a + 1]) + fy * ((1 - fx) * g[b] + fx * g[b + 1]);
  };
  return {mix(du_), mix(dv_)};
}

Mat2 Windscreen::delta_jacobian(const Vec2& uv) const {
  if (empty()) return Mat2::Zero();
  const double h = 0.5 * step_;
  Mat2 J;
  J.col(0) = (delta(uv + Vec2(h, 0)) - delta(uv - Vec2(h, 0))) / (2 * h);
  J.col(1) = (delta(uv + Vec2(0, h)) - delta(uv - Vec2(0, h))) / (2 * h);
  return J;
}

Vec2 Windscreen::undistort(const Vec2& raw) const {
  if (empty()) return raw;
  Vec2 q = raw;
  for (int n = 0; n < 20; ++n) {
    const Vec2 next = raw - delta(q);
    const double change = (next - q).norm();
    q = next;
    if (change < 1e-6) break;
  }
  return q;
}

Result<Windscreen> Windscreen::load(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return make_error(ErrorCode::kNotFound, path, "cannot be opened");
  char magic[8];
  std::int32_t size[2];
  double step = 0;
  in.read(magic, 8);
  in.read(reinterpret_cast<char*>(size), sizeof size);
  in.read(reinterpret_cast<char*>(&step), sizeof step);
  if (!in || std::memcmp(magic, kMagic, 8) != 0)
    return make_error(ErrorCode::kCorrupt, path, "does not begin with CYCWIND1 and a header of 24 bytes");
  if (size[0] < 2 || size[1] < 2 || size[0] > kMaxSide || size[1] > kMaxSide)
    return make_error(ErrorCode::kCorrupt, path, "grid is " + std::to_string(size[0]) + " x " + std::to_string(size[1]) + ", expected 2 to 8192 a side");
  const auto n = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
  const auto expected = static_cast<std::int64_t>(kHead + 2 * n * sizeof(float));
  in.seekg(0, std::ios::end);
  const auto there = static_cast<std::int64_t>(in.tellg());
  if (there != expected)  // before any memory is taken on the word of the header
    return make_error(there < expected ? ErrorCode::kTruncated : ErrorCode::kCorrupt, path,
                      "has " + std::to_string(there) + " bytes, expected " + std::to_string(expected) + " for a grid of " + std::to_string(size[0]) + " x " + std::to_string(size[1]));
  in.seekg(kHead);
  std::vector<float> du(n), dv(n);
  in.read(reinterpret_cast<char*>(du.data()), static_cast<std::streamsize>(n * sizeof(float)));
  in.read(reinterpret_cast<char*>(dv.data()), static_cast<std::streamsize>(n * sizeof(float)));
  if (!in) return make_error(ErrorCode::kIo, path, "cannot be read");
  auto w = from_grids(size[0], size[1], step, std::move(du), std::move(dv));
  if (!w.ok()) return make_error(w.error().code, path, w.error().what);
  return w;
}

Result<> Windscreen::save(const std::string& path) const {
  std::ofstream out(path, std::ios::binary);
  const std::int32_t size[2] = {rows_, cols_};
  out.write(kMagic, 8);
  out.write(reinterpret_cast<const char*>(size), sizeof size);
  out.write(reinterpret_cast<const char*>(&step_), sizeof step_);
  out.write(reinterpret_cast<const char*>(du_.data()), static_cast<std::streamsize>(du_.size() * sizeof(float)));
  out.write(reinterpret_cast<const char*>(dv_.data()), static_cast<std::streamsize>(dv_.size() * sizeof(float)));
  out.close();
  if (!out) return make_error(ErrorCode::kIo, path, "cannot be written");
  return Ok{};
}

}  // namespace cyclops
