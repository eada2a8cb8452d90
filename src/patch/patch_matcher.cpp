#include "patch/patch_matcher.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/ellipse.hpp"

namespace cyclops {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr int kMostMisses = 5;           // in a row, then the patch is taken anew
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

void PatchMatcher::step(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned, CornerSet& corners) {
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

/// By the feature's own patch of this flight, which learns from the frame. False: not found, or not to be believed.
bool PatchMatcher::own(const ImageView& image, const RowMask* missing, const Alignment& alignment, const Prediction& p, Corner& corner) {
  Patch& patch = patches_[p.feature];
  Vec2 place = p.uv_px;
  bool anew = !patch.known, good = false;
  if (patch.known) {
    PatchSearch::Found found;
    if (search_.turn(patch.stored, alignment.T_c_k, body_[p.feature]) && search_.match(image, missing, p, alignment.common_px, found)) {
      patch.misses = 0;
      const Vec2 gap = found.uv_px - p.uv_px - patch.offset_px;
      patch.wander2 += kWanderGain * (0.5 * gap.squaredNorm() - patch.wander2);
      patch.frames = std::min(patch.frames + 1, kLongest);
      patch.offset_px += gap / patch.frames;
      place = found.uv_px - patch.offset_px;
      corner.uv_px = place;
      corner.cov_px2 = found.cov_px2 + p.cov_px2 + std::max(kWanderShare * patch.wander2, config_.anchor_floor_px * config_.anchor_floor_px) * Mat2::Identity();
      corner.subpixel = true;
      corner.kind = PointKind::kPatch;
      corner.feature = p.feature;
      good = patch.wander2 <= config_.steady_px * config_.steady_px && larger_sigma(corner.cov_px2) <= config_.sigma_most_px;
      anew = !looks_alike(config_, patch.stored.T_c_k, alignment.T_c_k, body_[p.feature]);
    } else {
      anew = ++patch.misses >= kMostMisses;
    }
  }
  if (!anew) return good;
  const double frames = patch.known && patch.misses == 0 ? 0.5 * patch.frames : 0;
  patch.known = search_.take(image, missing, alignment.T_c_k, body_[p.feature], place, patch.stored);
  patch.frames = std::max(1.0, frames);
  patch.offset_px.setZero();
  if (frames == 0) patch.wander2 = kUnknownWander * config_.steady_px * config_.steady_px;
  patch.misses = 0;
  return good;
}

}  // namespace cyclops
