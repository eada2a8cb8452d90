#include "patch/patch_matcher.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/ellipse.hpp"

namespace cyclops {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr int kMostMisses = 5;          // in a row, then the patch is taken anew
constexpr double kLongest = 60;          // frames: the anchor follows the mean of so many
constexpr double kWanderGain = 0.2;
constexpr double kWanderShare = 0.2;     // of the variance about the anchor is the patch itself, the rest the pose of each frame
constexpr double kUnknownWander = 2;     // of a patch just taken, in units of the most that is steady

/// Line of sight in the tanker's axes, and range.
bool looks_alike(const PatchConfig& config, const Pose<frame::C, frame::K>& taken, const Pose<frame::C, frame::K>& T, const Point<frame::K>& p_k) {
  const Vec3 then = taken.rotation().matrix().transpose() * (taken * p_k).xyz;
  const Vec3 now = T.rotation().matrix().transpose() * (T * p_k).xyz;
  const double scale = then.norm() / now.norm();
  return scale < config.scale && scale > 1 / config.scale && then.normalized().dot(now.normalized()) > std::cos(config.view_deg * kDeg);
}

}  // namespace

PatchMatcher::PatchMatcher(const PatchConfig& config, const TankerModel& model, const Camera& camera, const Looks& looks)
    : config_(config), search_(config, camera), looks_(config, camera, looks, std::min(model.features().size(), kMaxFeatures)) {
  const std::size_t n = std::min(model.features().size(), kMaxFeatures);
  body_.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    body_.push_back(model.in_body(model.features()[i]));
    learnt_.push_back(model.features()[i].seen_from.has_value());
  }
  if (config.enabled) patches_.resize(n);
}

void PatchMatcher::reset() {
  for (Patch& p : patches_) p.known = false;
  looks_.reset();
}

void PatchMatcher::find(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned) {
  landmarks_.clear();
  for (Patch& p : patches_) p.found = false;
  if (!config_.enabled || image.data == nullptr) return;
  if (!alignment.consensus) return lapse();
  for (const Prediction& p : aligned.items) {
    Patch& patch = patches_[p.feature];
    if (p.visibility != Visibility::kVisible || !patch.known) continue;
    Prediction anchored = p;
    anchored.uv_px += patch.offset_px;
    PatchSearch::Found found;
    if (!search_.turn(patch.stored, alignment.T_c_k, body_[p.feature]) || !search_.match(image, missing, anchored, alignment.common_px, found)) continue;
    hold(patch, p.feature, found);
    if (!alignment.by_landmarks) learn(patch, found.uv_px - p.uv_px - patch.offset_px);
    patch.found = true;
    patch.misses = 0;
    patch.place_px = found.uv_px - patch.offset_px;
    patch.match_cov_px2 = found.cov_px2;
  }
}

/// A pose that is found again later is not held by what was learnt about the one before, until some frames have borne it out.
void PatchMatcher::lapse() {
  for (Patch& p : patches_) p.frames = std::min(p.frames, 0.5 * config_.hold_frames);
}

/// Before learn: the anchor holds nothing of this frame.
void PatchMatcher::hold(const Patch& patch, std::uint16_t feature, const PatchSearch::Found& found) {
  if (config_.hold_frames == 0 || patch.frames < config_.hold_frames || patch.wander2 > config_.hold_steady_px * config_.hold_steady_px) return;
  const double variance = kWanderShare * patch.wander2 + config_.hold_floor_px * config_.hold_floor_px;
  landmarks_.push_back({feature, found.uv_px - patch.offset_px, found.cov_px2 + variance * Mat2::Identity()});
}

/// `gap_px`: of a match from where the anchor expects it.
void PatchMatcher::learn(Patch& patch, const Vec2& gap_px) {
  patch.wander2 += kWanderGain * (0.5 * gap_px.squaredNorm() - patch.wander2);
  patch.frames = std::min(patch.frames + 1, kLongest);
  patch.offset_px += gap_px / patch.frames;
}

void PatchMatcher::measure(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned, CornerSet& corners) {
  if (!config_.enabled || !alignment.consensus || image.data == nullptr) return;
  const bool supported = alignment.inliers >= config_.least_support * alignment.considered;
  for (const Prediction& p : aligned.items) {
    if (p.visibility != Visibility::kVisible) continue;
    Corner corner, learnt;
    bool good = own(image, missing, alignment, p, corner);
    if (looks_.find(search_, image, missing, alignment, p, learnt) && (!good || (learnt_[p.feature] && larger_sigma(learnt.cov_px2) < larger_sigma(corner.cov_px2)))) {
      corner = learnt;
      good = true;
    }
    if (supported && good && !corners.items.try_push_back(corner)) ++corners.overflow;
  }
}

/// By the feature's own patch of this flight, which is taken anew where it has to be. False: not found, or not to be believed.
bool PatchMatcher::own(const ImageView& image, const RowMask* missing, const Alignment& alignment, const Prediction& p, Corner& corner) {
  Patch& patch = patches_[p.feature];
  bool good = false;
  if (patch.found) {
    corner.uv_px = patch.place_px;
    corner.cov_px2 = patch.match_cov_px2 + p.cov_px2 + std::max(kWanderShare * patch.wander2, config_.anchor_floor_px * config_.anchor_floor_px) * Mat2::Identity();
    corner.subpixel = true;
    corner.kind = PointKind::kPatch;
    corner.feature = p.feature;
    good = patch.wander2 <= config_.steady_px * config_.steady_px && larger_sigma(corner.cov_px2) <= config_.sigma_most_px;
    if (looks_alike(config_, patch.stored.T_c_k, alignment.T_c_k, body_[p.feature])) return good;
  } else if (patch.known && ++patch.misses < kMostMisses) {
    return false;
  }
  const double frames = patch.found ? 0.5 * patch.frames : 0;
  patch.known = search_.take(image, missing, alignment.T_c_k, body_[p.feature], patch.found ? patch.place_px : p.uv_px, patch.stored);
  patch.frames = std::max(1.0, frames);
  patch.offset_px.setZero();
  if (frames == 0) patch.wander2 = kUnknownWander * config_.steady_px * config_.steady_px;
  patch.misses = 0;
  return good;
}

}  // namespace cyclops
