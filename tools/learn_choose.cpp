#include "tools/learn_choose.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace cyclops::tools::learn {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr double kRangeStep = 1.25;           // ratio of the ends of a range bin
constexpr double kHalfFound = 0.5;            // ranges with less are not part of the sector
constexpr int kStretches = 8;                 // of a flight, for drift
constexpr std::size_t kLeastInStretch = 3;
constexpr double kScatterFloor_px = 0.05;
constexpr double kOutlierSigmas = 4;

Vec2 residual(const std::vector<View>& views, const LearntPoint& p, const Sight& s) {
  const View& view = views[static_cast<std::size_t>(s.view)];
  const auto at = view.camera->project(view.T_c_k * p.p_k);
  return at ? Vec2(view.corners[static_cast<std::size_t>(s.corner)].uv_px - *at) : Vec2(1e3, 1e3);
}

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

Vec3 to_camera_k(const View& view, const LearntPoint& p) { return view.T_c_k.inverse() * Point<frame::C>{} - p.p_k; }

int range_bin(double range_m) { return static_cast<int>(std::floor(std::log(range_m) / std::log(kRangeStep))); }

/// For each view: was the point found there?
std::vector<bool> found_in(const std::vector<View>& views, const LearntPoint& p) {
  std::vector<bool> found(views.size(), false);
  for (const Sight& s : p.sights) found[static_cast<std::size_t>(s.view)] = true;
  return found;
}

bool in_image(const View& view, const LearntPoint& p) {
  const auto at = view.camera->project(view.T_c_k * p.p_k);
  return at && at->x() > 8 && at->y() > 8 && at->x() < view.camera->intrinsics().width - 9 && at->y() < view.camera->intrinsics().height - 9;
}

/// Ranges around the one with most sights, as far as the point is found in at least half of the views.
void keep_good_ranges(const std::vector<View>& views, const LearntPoint& p, const std::vector<bool>& found, SeenFrom& sector) {
  std::map<int, std::pair<int, int>> bins;  // expected, found
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Vec3 d = TankerModel::direction_in_body(to_camera_k(views[v], p));  // its own inverse
    if (!in_image(views[v], p) || !sector.holds(d)) continue;
    auto& [expected, seen] = bins[range_bin(d.norm())];
    ++expected;
    seen += found[v] ? 1 : 0;
  }
  if (bins.empty()) return;
  auto best = std::max_element(bins.begin(), bins.end(), [](const auto& a, const auto& b) { return a.second.second < b.second.second; });
  auto low = best, high = best;
  const auto good = [](const auto& bin) { return bin.second.second >= kHalfFound * bin.second.first; };
  while (low != bins.begin() && good(*std::prev(low))) --low;
  while (std::next(high) != bins.end() && good(*std::next(high))) ++high;
  sector.least_m = std::max(sector.least_m, std::pow(kRangeStep, low->first));
  sector.most_m = std::min(sector.most_m, std::pow(kRangeStep, high->first + 1));
}

std::vector<Strength> strength_by_range(const std::vector<View>& views, const LearntPoint& p, const SeenFrom& sector) {
  std::map<std::pair<int, int>, Strength> bins;
  const std::vector<bool> found = found_in(views, p);
  std::map<int, double> square;  // by view
  for (const Sight& s : p.sights) square[s.view] = 0.5 * residual(views, p, s).squaredNorm();
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Vec3 d = TankerModel::direction_in_body(to_camera_k(views[v], p));
    if (!in_image(views[v], p) || !sector.holds(d)) continue;
    const int bin = range_bin(d.norm());
    Strength& s = bins[{views[v].flight, bin}];
    s.flight = views[v].flight;
    s.least_m = std::pow(kRangeStep, bin);
    s.most_m = std::pow(kRangeStep, bin + 1);
    ++s.expected;
    if (!found[v]) continue;
    ++s.found;
    s.rms_px += square[static_cast<int>(v)];
  }
  std::vector<Strength> out;
  for (auto& [key, s] : bins) {
    s.rms_px = std::sqrt(s.rms_px / std::max(1, s.found));
    out.push_back(s);
  }
  return out;
}

/// 1 sigma an axis of the place itself, in pixels of the view in the middle.
double place_sigma_px(const std::vector<View>& views, const LearntPoint& p) {
  const View& view = views[static_cast<std::size_t>(p.sights[p.sights.size() / 2].view)];
  const auto at = align::projected(*view.camera, view.T_c_k, p.p_k);
  if (!at) return 1e9;
  const Eigen::Matrix<double, 2, 3> J = at->by_point * view.T_c_k.rotation().matrix();
  return std::sqrt(0.5 * p.inflation * (J * p.cov_m2 * J.transpose()).trace());
}

/// Least distance of two points in some of the views of the first.
double distance_px(const std::vector<View>& views, const LearntPoint& p, const LearntPoint& q) {
  double least = 1e9;
  for (std::size_t i = 0; i < p.sights.size(); i += 1 + p.sights.size() / 6) {
    const View& view = views[static_cast<std::size_t>(p.sights[i].view)];
    const auto a = view.camera->project(view.T_c_k * p.p_k), b = view.camera->project(view.T_c_k * q.p_k);
    if (a && b) least = std::min(least, (*a - *b).norm());
  }
  return least;
}

double quality(const LearntPoint& p) { return p.strength / (p.scatter_px * p.scatter_px + p.drift_px * p.drift_px + 0.01); }

SeenFrom with_margin(SeenFrom s, const ChooseConfig& config) {
  const double angle = std::acos(std::clamp(s.least_cosine, -1.0, 1.0)) + config.sector_margin_deg * kDeg;
  s.least_cosine = angle < 180 * kDeg ? std::cos(angle) : -1;
  s.least_m /= config.range_margin;
  s.most_m *= config.range_margin;
  return s;
}

}  // namespace

void rate(const std::vector<View>& views, LearntPoint& p) {
  if (p.sights.empty()) return;
  std::vector<double> squares;
  for (const Sight& s : p.sights) squares.push_back(residual(views, p, s).squaredNorm());
  // Half of the squares of a round two-dimensional normal distribution are below 2 ln 2 times its variance an axis.
  p.scatter_px = std::max(kScatterFloor_px, std::sqrt(median(squares) / (2 * std::log(2.0))));
  const double most = std::pow(kOutlierSigmas * p.scatter_px, 2), variance = p.scatter_px * p.scatter_px;
  double chi2 = 0, drift2 = 0, stretches = 0;
  for (std::size_t first = 0; first < p.sights.size();) {
    std::size_t last = first;
    const int flight = views[static_cast<std::size_t>(p.sights[first].view)].flight;
    while (last < p.sights.size() && views[static_cast<std::size_t>(p.sights[last].view)].flight == flight) ++last;
    const std::size_t length = std::max(kLeastInStretch, (last - first + kStretches - 1) / kStretches);
    for (; first < last; first += length) {
      Vec2 mean(0, 0);
      double n = 0;
      for (std::size_t i = first; i < std::min(last, first + length); ++i) {
        if (squares[i] > most) continue;
        mean += residual(views, p, p.sights[i]);
        n += 1;
      }
      if (n < static_cast<double>(kLeastInStretch)) continue;
      mean /= n;
      chi2 += n * mean.squaredNorm() / variance;
      drift2 += 0.5 * mean.squaredNorm() - variance / n;
      stretches += 1;
    }
    first = last;
  }
  p.drift_px = stretches > 0 ? std::sqrt(std::max(0.0, drift2 / stretches)) : 0;
  p.inflation = stretches > 2 ? std::max(1.0, chi2 / (2 * stretches - 3)) : 1;
}

SeenFrom sector_of(const std::vector<View>& views, LearntPoint& p) {
  SeenFrom out;
  std::vector<double> cosines, ranges;
  Vec3 mean = Vec3::Zero();
  for (const Sight& s : p.sights) mean += to_camera_k(views[static_cast<std::size_t>(s.view)], p).normalized();
  if (p.sights.empty() || !(mean.norm() > 0)) return out;
  mean.normalize();
  for (const Sight& s : p.sights) {
    const Vec3 d = to_camera_k(views[static_cast<std::size_t>(s.view)], p);
    cosines.push_back(mean.dot(d.normalized()));
    ranges.push_back(d.norm());
  }
  std::sort(cosines.begin(), cosines.end());
  std::sort(ranges.begin(), ranges.end());
  const std::size_t tail = ranges.size() / 50;  // a few accidental finds do not make a sector
  out.axis_m = TankerModel::direction_in_body(mean);
  out.least_cosine = cosines[tail] - 1e-9;
  out.least_m = ranges[tail] * (1 - 1e-9);
  out.most_m = ranges[ranges.size() - 1 - tail] * (1 + 1e-9);
  const std::vector<bool> found = found_in(views, p);
  keep_good_ranges(views, p, found, out);
  double expected = 0, seen = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!in_image(views[v], p) || !out.holds(TankerModel::direction_in_body(to_camera_k(views[v], p)))) continue;
    expected += 1;
    seen += found[v] ? 1 : 0;
  }
  p.strength = seen / std::max(1.0, expected);
  return out;
}

std::vector<ChosenPoint> choose(const ChooseConfig& config, const std::vector<View>& views, const std::vector<LearntPoint>& points, Refused* refused) {
  Refused counts;
  std::vector<ChosenPoint> good;
  for (const LearntPoint& p : points) {
    ChosenPoint c{p, {}, {}};
    c.seen_from = sector_of(views, c.point);
    if (static_cast<int>(p.sights.size()) < config.least_sights) ++counts.few;
    else if (p.scatter_px > config.most_scatter_px) ++counts.scatter;
    else if (p.drift_px > config.most_drift_px) ++counts.drift;
    else if (c.point.strength < config.least_strength) ++counts.weak;
    else if (place_sigma_px(views, p) > config.most_sigma_px) ++counts.uncertain;
    else {
      c.strength = strength_by_range(views, c.point, c.seen_from);
      c.seen_from = with_margin(c.seen_from, config);
      good.push_back(std::move(c));
    }
  }
  std::stable_sort(good.begin(), good.end(), [](const ChosenPoint& a, const ChosenPoint& b) { return quality(a.point) > quality(b.point); });
  std::vector<ChosenPoint> out;
  for (ChosenPoint& c : good) {
    const bool near = std::any_of(out.begin(), out.end(), [&](const ChosenPoint& o) { return distance_px(views, o.point, c.point) < config.apart_px; });
    if (near || static_cast<int>(out.size()) == config.most_points) ++counts.near;
    else out.push_back(std::move(c));
  }
  if (refused != nullptr) *refused = counts;
  return out;
}

}  // namespace cyclops::tools::learn
