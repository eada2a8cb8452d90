#include "hil/flight_figures.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops::hil {
namespace {

using nlohmann::json;

constexpr std::uint16_t kFullScale = 4095;

std::size_t leg_at(const Scenario& s, double t) {
  std::size_t k = 0;
  for (; k + 1 < s.legs.size() && t >= s.legs[k].for_s; ++k) t -= s.legs[k].for_s;
  return k;
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (double x : v) sum += x;
  return v.empty() ? 0 : sum / static_cast<double>(v.size());
}

json spread(std::vector<double> v) {
  if (v.empty()) return {{"n", 0}};
  std::sort(v.begin(), v.end());
  const auto at = [&](double q) { return v[std::min(v.size() - 1, static_cast<std::size_t>(q * static_cast<double>(v.size())))]; };
  return {{"n", v.size()}, {"mean", mean(v)}, {"min", v.front()}, {"median", at(0.5)}, {"p95", at(0.95)}, {"max", v.back()}};
}

double rounded(double x) { return std::round(x * 1e5) * 1e-5; }

}  // namespace

PictureFigures::PictureFigures(const FlightScene& scene) : scene_(scene), segmenter_(std::make_unique<Segmenter>(SegmentConfig{})) {}

void PictureFigures::add(int i, const std::vector<std::uint16_t>& pixels, const std::vector<FeatureTruth>& truth) {
  const Scenario& s = scene_.scenario;
  OfFrame f{};
  f.range_ft = scene_.range_ft(i);
  f.leg = leg_at(s, scene_.mid_s(i) - scene_.mid_s(0));
  f.saturated_share = static_cast<double>(std::count_if(pixels.begin(), pixels.end(), [](std::uint16_t p) { return p >= kFullScale; })) / static_cast<double>(pixels.size());
  std::vector<Vec2> searched;
  int moving = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const FeatureTruth& t = truth[k];
    if (!t.in_front) continue;
    f.visible += t.visible && !t.doubtful;
    f.doubtful += t.doubtful;
    if (scene_.model.features()[k].enabled && scene_.camera.inside(t.raw_px)) searched.push_back(t.raw_px);
    if (!t.visible || k >= last_.size() || !last_[k].visible) continue;
    const double moved = (t.raw_px - last_[k].raw_px).norm();
    motions_px_.push_back(moved);
    f.motion_px += moved;
    ++moving;
  }
  if (moving > 0) f.motion_px /= moving;
  auto boxes = std::make_unique<SubImageSet>();
  segmenter_->segment(searched, s.camera.width, s.camera.height, *boxes);
  double area = 0;
  for (const SubImage& box : *boxes) area += static_cast<double>(box.width) * box.height;
  f.searched_share = area / static_cast<double>(pixels.size());
  frames_.push_back(f);
  last_ = truth;
}

json PictureFigures::json() const {
  const Scenario& s = scene_.scenario;
  const auto series = [&](double OfFrame::* what) {
    std::vector<double> v;
    for (const OfFrame& f : frames_) v.push_back(rounded(f.*what));
    return v;
  };
  nlohmann::json j;
  j["scenario"] = s.name;
  j["about"] = s.about;
  j["frames"] = s.frames;
  j["frame_rate_hz"] = s.frame_rate_hz;
  j["focal_mm"] = s.camera.fx_px * s.camera.pitch_m * 1e3;
  j["range_ft"] = spread(series(&OfFrame::range_ft));
  j["motion_px_a_frame"] = spread(motions_px_);
  j["features_visible"] = spread(series(&OfFrame::visible));
  j["features_not_scored"] = mean(series(&OfFrame::doubtful));
  j["saturated_share"] = spread(series(&OfFrame::saturated_share));
  j["searched_share"] = spread(series(&OfFrame::searched_share));
  for (std::size_t k = 0; k < s.legs.size(); ++k) {
    std::vector<double> motion, range;
    for (std::size_t i = 1; i < frames_.size(); ++i)
      if (frames_[i].leg == k) motion.push_back(frames_[i].motion_px), range.push_back(frames_[i].range_ft);
    if (motion.empty()) continue;
    const double time_s = static_cast<double>(range.size() - 1) / s.frame_rate_hz;
    j["legs"].push_back({{"name", s.legs[k].name}, {"frames", motion.size()}, {"motion_px_a_frame", mean(motion)}, {"from_ft", range.front()}, {"to_ft", range.back()},
                         {"closing_ftps", time_s > 0 ? (range.front() - range.back()) / time_s : 0.0}});
  }
  j["by_frame"] = {{"range_ft", series(&OfFrame::range_ft)}, {"motion_px", series(&OfFrame::motion_px)}, {"features_visible", series(&OfFrame::visible)},
                   {"saturated_share", series(&OfFrame::saturated_share)}};
  return j;
}

void ProjectionFigures::add(std::int32_t id, double error_px) {
  const auto bin = std::min(kBins - 1, static_cast<std::size_t>(std::lround(error_px)));
  ++counts_[bin];
  auto& own = by_feature_[id];
  own.resize(kBins);
  ++own[bin];
  sum_ += error_px, frame_sum_ += error_px;
  ++n_, ++frame_n_;
}

void ProjectionFigures::end_frame() {
  frame_mean_px_.push_back(frame_n_ > 0 ? rounded(frame_sum_ / frame_n_) : 0);
  frame_sum_ = 0;
  frame_n_ = 0;
}

json ProjectionFigures::json() const {
  nlohmann::json features;
  for (const auto& [id, counts] : by_feature_) features[std::to_string(id)] = counts;
  return {{"mean_px", mean_px()}, {"counts_by_px", counts_}, {"counts_by_feature", features}, {"by_frame_px", frame_mean_px_}};
}

}  // namespace cyclops::hil
