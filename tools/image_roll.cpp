#include "tools/image_roll.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops::tools {
namespace {

constexpr int kRounds = 6;

}  // namespace

std::optional<RollReference::Fit> RollReference::fit(const Shape& shape) const {
  Fit f;
  for (const ShapePoint& p : shape)
    if (const auto m = mean_.find(p.feature); m != mean_.end()) {
      f.from += m->second;
      f.to += p.xy;
      ++f.n;
    }
  if (f.n < kFewest) return std::nullopt;
  f.from /= static_cast<double>(f.n);
  f.to /= static_cast<double>(f.n);
  double dot = 0, cross = 0, from2 = 0, to2 = 0;
  for (const ShapePoint& p : shape)
    if (const auto m = mean_.find(p.feature); m != mean_.end()) {
      const Vec2 q = m->second - f.from, r = p.xy - f.to;
      dot += q.dot(r);
      cross += q.x() * r.y() - q.y() * r.x();
      from2 += q.squaredNorm();
      to2 += r.squaredNorm();
    }
  if (!(from2 > 0) || !(to2 > 0)) return std::nullopt;
  f.a = dot / from2;
  f.b = cross / from2;
  const double left = std::max(0.0, to2 - (dot * dot + cross * cross) / from2);
  f.rms = std::sqrt(left / static_cast<double>(2 * f.n - 4));    // four numbers of the similarity are fitted
  f.size = std::sqrt(from2) * std::hypot(f.a, f.b);
  return f;
}

std::optional<RollReading> RollReference::roll(const Shape& shape) const {
  const auto f = fit(shape);
  if (!f || !(f->size > 0)) return std::nullopt;
  return RollReading{std::atan2(f->b, f->a), f->rms / f->size};
}

Result<RollReference> RollReference::from(std::span<const Shape> frames) {
  const auto most = std::max_element(frames.begin(), frames.end(), [](const Shape& a, const Shape& b) { return a.size() < b.size(); });
  if (most == frames.end() || most->size() < kFewest)
    return make_error(ErrorCode::kNotFound, "image points", "no frame has " + std::to_string(kFewest) + " measured features");
  RollReference out;
  for (const ShapePoint& p : *most) out.mean_[p.feature] = p.xy;
  for (int round = 0; round < kRounds; ++round) {
    std::map<int, std::pair<Vec2, int>> sums;
    for (const Shape& shape : frames) {
      const auto f = out.fit(shape);
      if (!f) continue;
      const double n2 = f->a * f->a + f->b * f->b;
      for (const ShapePoint& p : shape) {              // back into the reference: the inverse of the similarity
        const Vec2 r = p.xy - f->to;
        auto& [sum, n] = sums.try_emplace(p.feature, Vec2(0, 0), 0).first->second;
        sum += f->from + Vec2(f->a * r.x() + f->b * r.y(), f->a * r.y() - f->b * r.x()) / n2;
        ++n;
      }
    }
    out.mean_.clear();
    for (const auto& [feature, s] : sums) out.mean_[feature] = s.first / s.second;
  }
  return out;
}

}  // namespace cyclops::tools
