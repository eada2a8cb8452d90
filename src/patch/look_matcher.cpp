#include "patch/look_matcher.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/ellipse.hpp"

namespace cyclops {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr double kGain = 0.1;        // of the newest frame in what a look has shown
constexpr double kMissSigmas = 2;    // a failed match, in units of steady_px

double learnt_square(const PatchConfig& config, const Look& look) {
  const double floor = config.anchor_floor_px, share = static_cast<double>(look.matched) / look.tried;
  const double missed = std::pow(kMissSigmas * config.steady_px, 2);
  return share * (look.scatter_px * look.scatter_px + floor * floor) + (1 - share) * missed;
}

/// From the feature to the camera, tanker body axes.
Vec3 to_camera_k(const Pose<frame::C, frame::K>& T_c_k, const Point<frame::K>& p_k) { return T_c_k.rotation().matrix().transpose() * -(T_c_k * p_k).xyz; }

}  // namespace

LookMatcher::LookMatcher(const PatchConfig& config, const Camera& camera, const Looks& looks, std::size_t features) : config_(config), camera_(camera), first_(features + 1, 0) {
  for (const Look& l : looks.items)
    if (l.feature < features)
      known_.push_back({&l, to_camera_k(l.patch.T_c_k, l.p_k).normalized(), std::sqrt(std::fabs(l.patch.then_px.determinant())) / l.patch.step_m, 0});
  std::stable_sort(known_.begin(), known_.end(), [](const Known& a, const Known& b) { return a.look->feature < b.look->feature; });
  for (const Known& k : known_) ++first_[k.look->feature + 1];
  for (std::size_t f = 0; f < features; ++f) first_[f + 1] += first_[f];
  reset();
}

void LookMatcher::reset() {
  for (Known& k : known_) k.square_px2 = learnt_square(config_, *k.look);
}

LookMatcher::Known* LookMatcher::choose(const Pose<frame::C, frame::K>& T, const Prediction& aligned) {
  Known* best = nullptr;
  double least = 1e9;
  for (std::size_t i = first_[aligned.feature]; i < first_[aligned.feature + 1]; ++i) {
    Known& k = known_[i];
    const Vec3 now = to_camera_k(T, k.look->p_k);
    const double range = now.norm();
    const double angle = std::acos(std::clamp(now.dot(k.seen_from) / range, -1.0, 1.0)) / (config_.view_deg * kDeg);
    const double scale = std::log(camera_.intrinsics().fx_px / range / k.px_per_m) / std::log(config_.scale);
    if (!(angle < 1 && std::fabs(scale) < 1)) continue;
    const double cost = k.square_px2 * (1 + angle * angle + scale * scale);
    if (cost >= least) continue;
    least = cost;
    best = &k;
  }
  return best;
}

bool LookMatcher::find(PatchSearch& search, const ImageView& image, const RowMask* missing, const Alignment& alignment, const Prediction& aligned, Corner& out) {
  Known* const k = choose(alignment.T_c_k, aligned);
  if (k == nullptr) return false;
  const Look& look = *k->look;
  PatchSearch::Found found;
  const bool matched = search.turn(look.patch, alignment.T_c_k, look.p_k) && search.match(image, missing, aligned, alignment.common_px, found);
  const double square = matched ? 0.5 * (found.uv_px - aligned.uv_px).squaredNorm() : std::pow(kMissSigmas * config_.steady_px, 2);
  k->square_px2 += kGain * (square - k->square_px2);
  if (!matched || k->square_px2 > config_.steady_px * config_.steady_px + 0.5 * aligned.cov_px2.trace()) return false;
  const double place2 = std::max(look.scatter_px * look.scatter_px, k->square_px2) + look.anchor_px * look.anchor_px + alignment.common_px * alignment.common_px;
  out.uv_px = found.uv_px;
  out.cov_px2 = found.cov_px2 + place2 * Mat2::Identity();
  out.subpixel = true;
  out.kind = PointKind::kPatch;
  out.feature = aligned.feature;
  return larger_sigma(out.cov_px2) <= config_.sigma_most_px;
}

}  // namespace cyclops
