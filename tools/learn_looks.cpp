#include "tools/learn_looks.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "patch/patch_search.hpp"

namespace cyclops::tools::learn {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr double kSearch_px = 0.8;   // 1 sigma of a place from an adjusted pose, generous

/// From the feature to the camera, tanker body axes; and pixels a metre.
struct Aspect {
  Vec3 seen_from{0, 0, 0};
  double px_per_m{0};
};

/// Distance of two aspects, in shares of the limits of the matcher: 1 is as far as a look may be used.
double apart(const PatchConfig& c, const Aspect& a, const Aspect& b) {
  const double angle = std::acos(std::clamp(a.seen_from.dot(b.seen_from), -1.0, 1.0)) / (c.view_deg * kDeg);
  return std::max(angle, std::fabs(std::log(a.px_per_m / b.px_per_m) / std::log(c.scale)));
}

std::string light_of(const std::string& flight) {
  std::string out = std::filesystem::path(flight).filename().string().substr(0, 100);
  for (char& c : out)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_' && c != '.') c = '_';
  return out.empty() ? "_" : out;
}

void spread_brightness(StoredPatch& patch) {
  const auto [low, high] = std::minmax_element(patch.store.begin(), patch.store.end());
  const float least = *low, gain = 255 / std::max(1.0F, *high - *low);
  for (float& x : patch.store) x = std::round((x - least) * gain);
}

/// One feature in the views in which it is to be seen.
class OfFeature {
 public:
  OfFeature(const PatchConfig& patch, const LooksConfig& config, const Views& views, const TankerModel& tanker, std::size_t feature)
      : patch_(patch), config_(config), views_(views), p_k_(tanker.in_body(tanker.features()[feature])), id_(tanker.features()[feature].id), feature_(feature) {
    for (std::size_t v = 0; v < views.views.size(); ++v)
      if (seen(views.views[v], tanker.features()[feature])) {
        seen_.push_back(v);
        aspects_.push_back(aspect(views.views[v]));
      }
  }

  void run(std::vector<Look>& out) {
    std::vector<Look> mine;
    std::vector<std::size_t> begun;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const int flight = view(i).flight;
      if (std::any_of(begun.begin(), begun.end(), [&](std::size_t b) { return view(b).flight == flight && apart(patch_, aspects_[b], aspects_[i]) < 0.5; })) continue;
      Look look;
      if (!take(i, look)) continue;
      begun.push_back(i);
      if (rate(i, look)) mine.push_back(std::move(look));
    }
    const auto worth = [](const Look& l) { return l.matched / ((l.scatter_px * l.scatter_px + 0.01) * l.tried); };
    std::stable_sort(mine.begin(), mine.end(), [&](const Look& a, const Look& b) { return worth(a) > worth(b); });
    if (mine.size() > static_cast<std::size_t>(config_.most_of_feature)) mine.resize(static_cast<std::size_t>(config_.most_of_feature));
    std::move(mine.begin(), mine.end(), std::back_inserter(out));
  }

 private:
  [[nodiscard]] const View& view(std::size_t i) const { return views_.views[seen_[i]]; }

  [[nodiscard]] bool seen(const View& v, const Feature& f) const {
    if (v.picture.pixels.empty() || !v.camera->project(v.T_c_k * p_k_)) return false;
    if (feature_ < v.visible.size()) return v.visible[feature_];
    return f.seen_from && f.seen_from->holds(TankerModel::direction_in_body(v.T_c_k.inverse() * Point<frame::C>{} - p_k_));
  }

  [[nodiscard]] Aspect aspect(const View& v) const {
    const Vec3 d = v.T_c_k.inverse() * Point<frame::C>{} - p_k_;
    return {d.normalized(), v.camera->intrinsics().fx_px / d.norm()};
  }

  /// Where the feature is in the picture of a view.
  [[nodiscard]] Vec2 place(const View& v) const { return *v.camera->project(v.T_c_k * p_k_) - Vec2(v.picture.u0, v.picture.v0); }

  bool take(std::size_t i, Look& look) const {
    const View& v = view(i);
    look.id = id_;
    look.feature = feature_;
    look.p_k = p_k_;
    look.light = light_of(views_.flights[static_cast<std::size_t>(v.flight)]);
    if (!PatchSearch(patch_, *v.camera).take(v.picture.image(), nullptr, v.T_c_k, p_k_, place(v), look.patch) || look.patch.then_px.isZero()) return false;
    spread_brightness(look.patch);
    return true;
  }

  /// Searches the look in the other views; false when it is worth nothing.
  bool rate(std::size_t own, Look& look) const {
    std::vector<std::size_t> others;
    for (std::size_t i = 0; i < seen_.size(); ++i)
      if (i != own && apart(patch_, aspects_[i], aspects_[own]) < 1) others.push_back(i);
    const std::size_t step = 1 + others.size() / static_cast<std::size_t>(config_.most_tried);
    std::vector<Vec2> gaps;  // in the look's picture
    std::vector<double> correlations;
    for (std::size_t i = 0; i < others.size(); i += step) {
      const View& v = view(others[i]);
      PatchSearch search(patch_, *v.camera);
      PatchSearch::Found found;
      Prediction p;
      p.uv_px = place(v);
      p.cov_px2 = kSearch_px * kSearch_px * Mat2::Identity();
      ++look.tried;
      if (!search.turn(look.patch, v.T_c_k, p_k_) || !search.match(v.picture.image(), nullptr, p, 0, found)) continue;
      gaps.push_back(search.then_from_now() * (found.uv_px - p.uv_px));
      correlations.push_back(found.correlation);
    }
    return look.tried > 0 && settle(gaps, correlations, pose_sigma_px(view(own)), look);
  }

  /// 1 sigma an axis of the feature's place from the pose of a view.
  [[nodiscard]] double pose_sigma_px(const View& v) const {
    const auto at = align::projected(*v.camera, v.T_c_k, p_k_);
    return at ? std::sqrt(0.5 * (at->by_pose * v.covariance * at->by_pose.transpose()).trace()) : 1e3;
  }

  bool settle(const std::vector<Vec2>& gaps, const std::vector<double>& correlations, double pose_px, Look& look) const {
    Vec2 mean(0, 0);
    double square = 0, correlation = 0;
    for (int round = 0; round < 3; ++round) {  // what is far from the mean is left out of it
      Vec2 sum(0, 0);
      square = correlation = look.matched = 0;
      for (std::size_t i = 0; i < gaps.size(); ++i) {
        if (round > 0 && (gaps[i] - mean).norm() > config_.most_away_px) continue;
        sum += gaps[i];
        square += 0.5 * (gaps[i] - mean).squaredNorm();
        correlation += correlations[i];
        ++look.matched;
      }
      if (look.matched < config_.least_matched) return false;
      mean = sum / look.matched;
    }
    look.scatter_px = std::sqrt(square / look.matched);
    look.anchor_px = std::hypot(config_.pose_doubt * pose_px, look.scatter_px / std::sqrt(std::max(1.0, look.matched / config_.independent)));
    look.correlation = std::min(1.0, correlation / look.matched);
    look.patch.inside_px -= mean;
    return look.matched >= config_.least_share * look.tried && look.scatter_px <= config_.most_scatter_px;
  }

  const PatchConfig& patch_;
  const LooksConfig& config_;
  const Views& views_;
  Point<frame::K> p_k_;
  std::int32_t id_;
  std::size_t feature_;
  std::vector<std::size_t> seen_;      // views
  std::vector<Aspect> aspects_;        // of these
};

}  // namespace

Looks learn_looks(const PatchConfig& patch, const LooksConfig& config, const Views& views, const TankerModel& tanker) {
  Looks out;
  for (std::size_t f = 0; f < tanker.features().size(); ++f)
    if (tanker.features()[f].enabled) OfFeature(patch, config, views, tanker, f).run(out.items);
  return out;
}

}  // namespace cyclops::tools::learn
