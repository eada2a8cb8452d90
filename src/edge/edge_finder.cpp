#include "edge/edge_finder.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/ellipse.hpp"

namespace cyclops {
namespace {

constexpr double kSpacing_px = 2;
constexpr double kEnds_px = 4;              // left out at both ends, where other edges meet
constexpr double kShortest_px = 14;
constexpr double kUnknownStrength = 0.3;
constexpr double kInner[2] = {0.5 - 0.28867513459481287, 0.5 + 0.28867513459481287};  // offsets of a fitted line are independent here
constexpr double kBin_px = 0.5;
constexpr int kSlopes = 4;                  // votes for slopes of -4 .. 4 bins from end to end
constexpr int kRounds = 5;
constexpr std::size_t kMostOthers = 64;     // features that one is paired with, the nearest
constexpr double kModelSigma_px = 0.05;     // of one sample, beside what its line shows
constexpr double kParallel = 0.35;          // sine of the angle below which edges do not cross

/// Pixel by bilinear interpolation; the four pixels must exist.
template <class T>
float between(const ImageView& image, double u, double v) {
  const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
  const auto fu = static_cast<float>(u - u0), fv = static_cast<float>(v - v0);
  const T* a = reinterpret_cast<const T*>(image.row8(v0)) + u0;
  const T* b = reinterpret_cast<const T*>(image.row8(v0 + 1)) + u0;
  const float top = static_cast<float>(a[0]) + fu * (static_cast<float>(a[1]) - static_cast<float>(a[0]));
  const float low = static_cast<float>(b[0]) + fu * (static_cast<float>(b[1]) - static_cast<float>(b[0]));
  return top + fv * (low - top);
}

Vec2 left_of(const Vec2& direction) { return {-direction.y(), direction.x()}; }

}  // namespace

EdgeFinder::EdgeFinder(const EdgeConfig& config, const TankerModel& model, const Camera& camera) : config_(config), camera_(camera) {
  const std::size_t n = std::min(model.features().size(), kMaxFeatures);
  for (std::size_t i = 0; i < n; ++i) {
    body_.push_back(model.in_body(model.features()[i]));
    enabled_.push_back(model.features()[i].enabled);
  }
  std::vector<std::pair<double, std::size_t>> others;
  for (std::size_t i = 0; i < n; ++i) {
    others.clear();
    for (std::size_t j = i + 1; j < n; ++j)
      if (enabled_[i] && enabled_[j]) others.emplace_back((body_[i].xyz - body_[j].xyz).norm(), j);
    std::sort(others.begin(), others.end());
    if (others.size() > kMostOthers) others.resize(kMostOthers);
    for (const auto& [distance, j] : others)
      pairs_.push_back({{static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j)}, kUnknownStrength, config.bias_sigma_px * config.bias_sigma_px});
  }
  chosen_.reserve(pairs_.size());
  bends_.reserve(static_cast<std::size_t>(kMostSamples) * (2 * kMostReach + 1));
}

Point<frame::K> EdgeFinder::along(const Pair& pair, double share) const {
  const Vec3& a = body_[pair.feature[0]].xyz;
  return Point<frame::K>(a + share * (body_[pair.feature[1]].xyz - a));
}

/// The proven pairs that can be seen, strongest first, then others in turn.
void EdgeFinder::choose(const PredictionSet& aligned) {
  const auto seen = [&](const Pair& p) {
    for (const std::uint16_t f : p.feature)
      if (f >= aligned.items.size() || aligned.items[f].visibility != Visibility::kVisible) return false;
    return (aligned.items[p.feature[0]].uv_px - aligned.items[p.feature[1]].uv_px).norm() >= kShortest_px;
  };
  chosen_.clear();
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    if (pairs_[i].strength > kUnknownStrength && seen(pairs_[i])) chosen_.push_back(static_cast<std::uint32_t>(i));
  const auto most = static_cast<std::size_t>(config_.pairs), strong = most - most / 4;
  if (chosen_.size() > strong) {
    const auto stronger = [&](std::uint32_t a, std::uint32_t b) { return std::pair(-pairs_[a].strength, a) < std::pair(-pairs_[b].strength, b); };
    std::nth_element(chosen_.begin(), chosen_.begin() + static_cast<std::ptrdiff_t>(strong), chosen_.end(), stronger);
    chosen_.resize(strong);
  }
  for (std::size_t looked = 0; looked < pairs_.size() && chosen_.size() < most; ++looked) {
    turn_ = (turn_ + 1) % pairs_.size();
    if (pairs_[turn_].strength <= kUnknownStrength && seen(pairs_[turn_])) chosen_.push_back(static_cast<std::uint32_t>(turn_));
  }
}

void EdgeFinder::find(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned, EdgeSet& out) {
  out.clear();
  if (!alignment.consensus || image.data == nullptr || pairs_.empty()) return;
  choose(aligned);
  for (const std::uint32_t pair : chosen_) {
    Edge edge;
    if (measure(image, missing, alignment, aligned, pair, edge)) out.push_back(edge);
  }
}

bool EdgeFinder::measure(const ImageView& image, const RowMask* missing, const Alignment& alignment, const PredictionSet& aligned, std::size_t index, Edge& out) {
  const Pair& pair = pairs_[index];
  double variance = pair.bias2;
  for (const std::uint16_t f : pair.feature) variance += 0.25 * aligned.items[f].cov_px2.trace();
  const double sigma = std::sqrt(variance);
  if (!lay_samples(alignment, index, std::clamp(config_.search_sigmas * sigma, config_.search_least_px, config_.search_most_px))) return false;
  take_profiles(image, missing);
  // Gradient mask [1 2 0 -2 -1] / 8 on interpolated pixels.
  find_peaks(config_.contrast_sigmas * std::sqrt(10.0 / 64) * noise_sigma());
  double score[2];
  Line line[2];
  for (int rising = 0; rising < 2; ++rising) line[rising] = vote(rising != 0, std::max(1.0, sigma), score[rising]);
  const bool rising = score[1] > score[0];
  Line& best = line[rising ? 1 : 0];
  if (!fit(rising, best, out.sigma_px, out.coverage)) return false;
  out.pair = static_cast<std::uint32_t>(index);
  out.bias_sigma_px = std::sqrt(pair.bias2);
  out.proven = pair.strength >= config_.proven;
  for (int i = 0; i < 2; ++i) {
    out.feature[i] = pair.feature[i];
    for (Edge::Point* p : {&out.inner[i], &out.end[i]}) {
      p->share = p == &out.inner[i] ? kInner[i] : i;
      const auto here = camera_.project(alignment.T_c_k * along(pair, p->share));
      const auto ahead = camera_.project(alignment.T_c_k * along(pair, p->share + (i == 0 ? 0.02 : -0.02)));
      if (!here || !ahead) return false;
      p->normal = left_of(((i == 0 ? 1.0 : -1.0) * (*ahead - *here)).normalized());
      p->uv_px = *here + best.at(p->share) * p->normal;
    }
  }
  return true;
}

bool EdgeFinder::lay_samples(const Alignment& alignment, std::size_t index, double reach_px) {
  const Pair& pair = pairs_[index];
  const auto a = camera_.project(alignment.T_c_k * body_[pair.feature[0]]), b = camera_.project(alignment.T_c_k * body_[pair.feature[1]]);
  if (!a || !b) return false;
  const double length = (*b - *a).norm();
  if (length < kShortest_px) return false;
  reach_ = std::min(kMostReach, static_cast<int>(std::ceil(reach_px)) + 2);
  const double margin = std::min(0.3, std::max(kEnds_px / length, 0.05));
  count_ = static_cast<std::size_t>(std::clamp(static_cast<int>(length * (1 - 2 * margin) / kSpacing_px), 4, kMostSamples));
  const double step = (1 - 2 * margin) / static_cast<double>(count_ - 1);
  for (std::size_t i = 0; i < count_; ++i) {
    Sample& s = samples_[i];
    s.share = margin + step * static_cast<double>(i);
    const auto uv = camera_.project(alignment.T_c_k * along(pair, s.share));
    if (!uv) return false;
    s.at_px = *uv;
  }
  for (std::size_t i = 0; i < count_; ++i)
    samples_[i].normal = left_of((samples_[std::min(i + 1, count_ - 1)].at_px - samples_[i == 0 ? 0 : i - 1].at_px).normalized());
  return true;
}

void EdgeFinder::take_profiles(const ImageView& image, const RowMask* missing) {
  for (std::size_t i = 0; i < count_; ++i) {
    Sample& s = samples_[i];
    const Vec2 first = s.at_px - reach_ * s.normal, last = s.at_px + reach_ * s.normal;
    const auto [v_low, v_high] = std::minmax(first.y(), last.y());
    const auto [u_low, u_high] = std::minmax(first.x(), last.x());
    s.readable = u_low >= 0 && v_low >= 0 && u_high < image.width - 1 && v_high < image.height - 1;
    if (s.readable && missing != nullptr)
      for (int v = static_cast<int>(v_low); v <= static_cast<int>(v_high) + 1; ++v) s.readable = s.readable && !missing->missing(v);
    if (!s.readable) continue;
    for (int k = -reach_; k <= reach_; ++k) {
      const Vec2 p = s.at_px + k * s.normal;
      s.profile[static_cast<std::size_t>(k + reach_)] =
          bytes_per_pixel(image.format) == 1 ? between<std::uint8_t>(image, p.x(), p.y()) : between<std::uint16_t>(image, p.x(), p.y());
    }
  }
}

/// Of one interpolated pixel, from the median bend of the profiles. At least that of rounding to whole counts.
double EdgeFinder::noise_sigma() {
  bends_.clear();
  for (std::size_t i = 0; i < count_; i += 3)
    for (int k = 1; samples_[i].readable && k < 2 * reach_; ++k) {
      const float* f = &samples_[i].profile[static_cast<std::size_t>(k)];
      bends_.push_back(std::fabs(f[-1] - 2 * f[0] + f[1]));
    }
  if (bends_.empty()) return 1;
  const auto middle = bends_.begin() + static_cast<std::ptrdiff_t>(bends_.size() / 2);
  std::nth_element(bends_.begin(), middle, bends_.end());
  return std::max(0.3, static_cast<double>(*middle) / 0.6745 / std::sqrt(6.0));
}

/// The strongest extrema of the gradient in each profile, between the pixels.
void EdgeFinder::find_peaks(double least_gradient) {
  for (std::size_t i = 0; i < count_; ++i) {
    Sample& s = samples_[i];
    s.peaks = 0;
    if (!s.readable) continue;
    std::array<float, 2 * kMostReach + 1> g{};
    std::array<float, kMostPeaks> height{};
    const int n = 2 * reach_ + 1;
    for (int k = 2; k < n - 2; ++k) {
      const float* f = &s.profile[static_cast<std::size_t>(k)];
      g[static_cast<std::size_t>(k)] = 0.125F * (f[2] - f[-2] + 2 * (f[1] - f[-1]));
    }
    for (int k = 3; k < n - 3; ++k) {
      const bool rising = g[static_cast<std::size_t>(k)] > 0;
      const float sign = rising ? 1.0F : -1.0F;
      const float before = sign * g[static_cast<std::size_t>(k - 1)], here = sign * g[static_cast<std::size_t>(k)], after = sign * g[static_cast<std::size_t>(k + 1)];
      if (here < least_gradient || here <= before || here < after) continue;
      const float bend = before - 2 * here + after;
      const Peak peak{static_cast<float>(k - reach_) + (bend < 0 ? 0.5F * (before - after) / bend : 0.0F), rising};
      int at = s.peaks < kMostPeaks ? s.peaks++ : kMostPeaks;
      for (; at > 0 && height[static_cast<std::size_t>(at - 1)] < here; --at)
        if (at < kMostPeaks) {
          s.peak[static_cast<std::size_t>(at)] = s.peak[static_cast<std::size_t>(at - 1)];
          height[static_cast<std::size_t>(at)] = height[static_cast<std::size_t>(at - 1)];
        }
      if (at < kMostPeaks) {
        s.peak[static_cast<std::size_t>(at)] = peak;
        height[static_cast<std::size_t>(at)] = here;
      }
    }
  }
}

/// The line that most samples vote for; votes for lines far from the prediction count less.
EdgeFinder::Line EdgeFinder::vote(bool rising, double sigma_px, double& score) const {
  constexpr int kBins = 4 * kMostReach + 3;
  std::array<std::array<float, kBins>, 2 * kSlopes + 1> votes{};
  const int middle = kBins / 2;
  for (std::size_t i = 0; i < count_; ++i)
    for (int k = 0; k < samples_[i].peaks; ++k) {
      const Peak& p = samples_[i].peak[static_cast<std::size_t>(k)];
      if (p.rising != rising) continue;
      for (int slope = -kSlopes; slope <= kSlopes; ++slope) {
        const double bin = (p.offset_px - slope * kBin_px * (samples_[i].share - 0.5)) / kBin_px + middle;
        const int low = static_cast<int>(std::floor(bin));
        if (low < 0 || low + 1 >= kBins) continue;
        auto& row = votes[static_cast<std::size_t>(slope + kSlopes)];
        const auto part = static_cast<float>(bin - low);
        row[static_cast<std::size_t>(low)] += 1 - part;
        row[static_cast<std::size_t>(low + 1)] += part;
      }
    }
  const double width = 0.5 / (2.25 * sigma_px * sigma_px);
  std::array<double, kBins> near;
  for (int bin = 0; bin < kBins; ++bin) near[static_cast<std::size_t>(bin)] = std::exp(-width * (bin - middle) * (bin - middle) * kBin_px * kBin_px);
  Line best;
  score = 0;
  for (int slope = -kSlopes; slope <= kSlopes; ++slope) {
    const auto& row = votes[static_cast<std::size_t>(slope + kSlopes)];
    const double level = std::exp(-width * slope * slope * kBin_px * kBin_px / 6);
    for (std::size_t bin = 1; bin + 1 < kBins; ++bin) {
      const double s = (row[bin] + 0.5 * (row[bin - 1] + row[bin + 1])) * near[bin] * level;
      if (s <= score) continue;
      score = s;
      best = {(static_cast<int>(bin) - middle) * kBin_px, slope * kBin_px};
    }
  }
  return best;
}

/// Least squares with Tukey's weights through the peaks nearest the line. False when they are too few or leave a part out.
bool EdgeFinder::fit(bool rising, Line& line, double& sigma_px, double& coverage) const {
  double sum_r2 = 0, determinant = 0;
  int inliers = 0, readable = 0;
  std::array<int, 3> third{}, third_of{};
  for (int round = 0; round < kRounds; ++round) {
    const double reach = round < 2 ? 2 * config_.straight_px : config_.straight_px;
    double n = 0, x = 0, xx = 0, y = 0, xy = 0;
    sum_r2 = 0;
    inliers = readable = 0;
    third.fill(0);
    third_of.fill(0);
    for (std::size_t i = 0; i < count_; ++i) {
      const Sample& s = samples_[i];
      if (!s.readable) continue;
      const auto part = 3 * i / count_;
      ++readable;
      ++third_of[part];
      const double predicted = line.at(s.share);
      double least = reach;
      const Peak* nearest = nullptr;
      for (int k = 0; k < s.peaks; ++k) {
        const Peak& p = s.peak[static_cast<std::size_t>(k)];
        if (p.rising == rising && std::fabs(p.offset_px - predicted) < least) {
          least = std::fabs(p.offset_px - predicted);
          nearest = &p;
        }
      }
      if (nearest == nullptr) continue;
      ++inliers;
      ++third[part];
      const double r = least / reach, w = (1 - r * r) * (1 - r * r), t = s.share - 0.5;
      sum_r2 += least * least;
      n += w;
      x += w * t;
      xx += w * t * t;
      y += w * nearest->offset_px;
      xy += w * t * nearest->offset_px;
    }
    determinant = n * xx - x * x;
    if (inliers < 4 || !(determinant > 1e-9)) return false;
    line = {(xx * y - x * xy) / determinant, (n * xy - x * y) / determinant};
  }
  if (2 * readable < static_cast<int>(count_)) return false;
  for (std::size_t part = 0; part < 3; ++part)
    if (2 * third[part] < third_of[part]) return false;
  coverage = static_cast<double>(inliers) / static_cast<double>(count_);
  sigma_px = std::sqrt(2 * (sum_r2 / std::max(1, inliers - 2) + kModelSigma_px * kModelSigma_px) * kSpacing_px / inliers);
  return coverage >= config_.coverage;
}

void EdgeFinder::learn(const Alignment& alignment, const EdgeSet& found) {
  if (!alignment.consensus) return;
  for (const std::uint32_t index : chosen_) pairs_[index].strength -= config_.strength_gain * pairs_[index].strength;
  for (const Edge& edge : found) {
    Pair& pair = pairs_[edge.pair];
    double sum = 0;
    bool before_camera = true;
    for (const Edge::Point& p : edge.inner) {
      const auto there = camera_.project(alignment.T_c_k * along(pair, p.share));
      before_camera = before_camera && there.has_value();
      const double r = there ? p.normal.dot(p.uv_px - *there) : 0;
      sum += 0.5 * std::min(r * r, 9.0);
    }
    if (!before_camera) continue;
    pair.strength += config_.strength_gain;
    pair.bias2 = std::max(pair.bias2 + config_.bias_gain * (sum - pair.bias2), config_.bias_floor_px * config_.bias_floor_px);
  }
  chosen_.clear();
}

void EdgeFinder::crossings(const EdgeSet& found, CornerSet& corners) const {
  for (std::size_t f = 0; f < body_.size(); ++f) {
    Mat2 N = Mat2::Zero();
    Vec2 b = Vec2::Zero(), around = Vec2::Zero();
    double widest = 0;
    int n = 0;
    Vec2 first = Vec2::Zero();
    const auto each = [&](const auto& use) {
      for (const Edge& e : found)
        for (int i = 0; i < 2; ++i)
          if (e.proven && e.feature[i] == f) use(e.end[i], 2 * e.sigma_px * e.sigma_px + e.bias_sigma_px * e.bias_sigma_px);
    };
    each([&](const Edge::Point& p, double variance) {
      if (n++ == 0) {
        first = p.normal;
        around = p.uv_px;
      }
      widest = std::max(widest, std::fabs(first.x() * p.normal.y() - first.y() * p.normal.x()));
      N += p.normal * p.normal.transpose() / variance;
      b += p.normal * (p.normal.dot(p.uv_px - around) / variance);
    });
    if (n < 2 || widest < kParallel || !(N.determinant() > 0)) continue;
    Corner corner;
    corner.cov_px2 = N.inverse();
    const Vec2 shift = corner.cov_px2 * b;
    double chi2 = 0;
    each([&](const Edge::Point& p, double variance) {
      const double r = p.normal.dot(around + shift - p.uv_px);
      chi2 += r * r / variance;
    });
    corner.cov_px2 *= std::max(1.0, n > 2 ? chi2 / (n - 2) : 1.0);
    if (larger_sigma(corner.cov_px2) > config_.crossing_sigma_px) continue;
    corner.uv_px = around + shift;
    corner.subpixel = true;
    corner.kind = PointKind::kCrossing;
    corner.feature = static_cast<std::int32_t>(f);
    if (!corners.items.try_push_back(corner)) ++corners.overflow;
  }
}

}  // namespace cyclops
