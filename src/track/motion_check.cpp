#include "track/motion_check.hpp"

#include <algorithm>

namespace cyclops {

void MotionConfig::read(ConfigTable& table) {
  table.read_in("motion_window_s", 0.0, 10.0, window_s);
  table.read_in("motion_least_s", 0.03, 10.0, least_s);
  table.read_in("motion_chi_square", 0.1, 1e6, chi_square);
  table.read_in("motion_sigma_px", 0.0, 100.0, sigma_px);
  table.read_in("motion_correlation_s", 0.0, 10.0, correlation_s);
  table.read_in("motion_drift_px_s", 0.0, 1000.0, drift_px_s);
}

MotionCheck::MotionCheck(const MotionConfig& config) : config_(config), courses_(config.window_s > 0 ? kMaxFeatures : 0) {
  slopes_.reserve(kMaxFeatures);
  sorted_.reserve(kMaxFeatures);
}

void MotionCheck::add(Course& course, const Sample& sample) const {
  if (course.count > 0) {
    const Sample& before = course.last();
    const double jump2 = (sample.off_px - before.off_px).squaredNorm();
    const bool broken = (sample.t - before.t).seconds() > kGap_s || jump2 > kJump * (sample.variance_px2 + before.variance_px2);
    if (broken) course.count = 0;
  }
  while (course.count > 0 && (course.count == kMost || (sample.t - course.at(0).t).seconds() > config_.window_s)) {
    course.first = (course.first + 1) % kMost;
    --course.count;
  }
  course.sample[(course.first + course.count++) % kMost] = sample;
}

/// Least squares over the course; nothing when it is too short.
std::optional<MotionCheck::Slope> MotionCheck::slope(const Course& course) const {
  const double lasted = course.count < 3 ? 0 : (course.last().t - course.at(0).t).seconds();
  if (lasted < config_.least_s) return std::nullopt;
  const double n = static_cast<double>(course.count);
  double st = 0, stt = 0, stated = 0;
  Vec2 sr = Vec2::Zero(), str = Vec2::Zero();
  double srr = 0;
  for (std::size_t i = 0; i < course.count; ++i) {
    const Sample& s = course.at(i);
    const double t = (s.t - course.at(0).t).seconds();
    st += t;
    stt += t * t;
    sr += s.off_px;
    str += t * s.off_px;
    srr += s.off_px.squaredNorm();
    stated += s.variance_px2;
  }
  const double sxx = stt - st * st / n;
  Slope out;
  out.px_s = (str - st * sr / n) / sxx;
  const double about = std::max(0.0, srr - sr.squaredNorm() / n - sxx * out.px_s.squaredNorm());
  const double scatter = n > 2 ? 0.5 * about / (n - 2) : 0;
  const double frames_in_one = std::max(1.0, config_.correlation_s * (n - 1) / lasted);
  out.variance = std::max(stated / n, scatter) * frames_in_one / sxx + config_.drift_px_s * config_.drift_px_s;
  return out;
}

/// Median slope, axis by axis; 0 for a few features, which could all be wrong.
Vec2 MotionCheck::common() {
  Vec2 out = Vec2::Zero();
  if (slopes_.size() < kGroup) return out;
  for (int axis = 0; axis < 2; ++axis) {
    sorted_.clear();
    for (const Slope& s : slopes_) sorted_.push_back(s.px_s[axis]);
    const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
    std::nth_element(sorted_.begin(), middle, sorted_.end());
    out[axis] = *middle;
  }
  return out;
}

std::size_t MotionCheck::step(Time t, const PredictionSet* expected, const TrackSet& tracks, const CornerSet& corners, MatchSet& matches) {
  if (courses_.empty()) return 0;
  if (expected == nullptr) {
    for (Course& c : courses_) c.count = 0;
    return 0;
  }
  CYCLOPS_ASSERT(matches.size() == tracks.size());
  slopes_.clear();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i].corner < 0 || tracks[i].feature >= expected->items.size()) continue;
    const Corner& corner = corners.items[static_cast<std::size_t>(matches[i].corner)];
    Course& course = courses_[tracks[i].feature];
    add(course, {t, corner.uv_px - expected->items[tracks[i].feature].uv_px, 0.5 * corner.cov_px2.trace() + config_.sigma_px * config_.sigma_px});
    if (auto s = slope(course); s) {
      s->track = i;
      slopes_.push_back(*s);
    }
  }
  const Vec2 group = common();
  std::size_t refused = 0;
  for (const Slope& s : slopes_) {
    if ((s.px_s - group).squaredNorm() <= config_.chi_square * s.variance) continue;
    matches[s.track].corner = -1;
    matches[s.track].reason = MatchReason::kAgainstMotion;
    matches[s.track].gain_px = 0;
    ++refused;
  }
  return refused;
}

}  // namespace cyclops
