#include "tools/learn_points.hpp"

#include <algorithm>
#include <cmath>

#include "tools/learn_sift.hpp"

namespace cyclops::tools::learn {
namespace {

constexpr std::size_t kMostUsed = 40;  // sights of one triangulation
constexpr double kHuber = 2.5;         // sigma

Point<frame::K> lens_in_body(const CameraPose& T_c_k) { return T_c_k.inverse() * Point<frame::C>{}; }

struct Follower {
  LearntPoint point;
  PointPrior prior;
  Patch patch{};
  int misses{0};
  bool located{false};
};

/// The sight of a follower in a view, were it this corner.
struct Pairing {
  double score;
  std::size_t follower;
  int corner;
};

class Following {
 public:
  Following(const Views& all, const FollowConfig& config) : all_(all), config_(config), extent_(all.tanker) {}

  std::vector<LearntPoint> run() {
    int flight = -1;
    for (int v = 0; v < static_cast<int>(all_.views.size()); ++v) {
      if (all_.views[static_cast<std::size_t>(v)].flight != flight) retire(0);
      flight = all_.views[static_cast<std::size_t>(v)].flight;
      go_on(v);
    }
    retire(0);
    return without_doubles();
  }

 private:
  void go_on(int v) {
    const View& view = all_.views[static_cast<std::size_t>(v)];
    std::vector<Pairing> pairings;
    for (std::size_t f = 0; f < live_.size(); ++f) pair(view, f, pairings);
    std::sort(pairings.begin(), pairings.end(), [](const Pairing& a, const Pairing& b) { return a.score > b.score; });
    std::vector<bool> claimed(view.corners.size(), false), found(live_.size(), false);
    for (const Pairing& p : pairings) {
      if (claimed[static_cast<std::size_t>(p.corner)] || found[p.follower]) continue;
      claimed[static_cast<std::size_t>(p.corner)] = found[p.follower] = true;
      add(v, p.corner, live_[p.follower]);
    }
    for (std::size_t f = 0; f < live_.size(); ++f) live_[f].misses = found[f] ? 0 : live_[f].misses + 1;
    retire(config_.most_misses);
    for (std::size_t c = 0; c < claimed.size(); ++c)
      if (!claimed[c]) begin(v, static_cast<int>(c));
  }

  void pair(const View& view, std::size_t f, std::vector<Pairing>& out) const {
    const Follower& follower = live_[f];
    const auto at = align::projected(*view.camera, view.T_c_k, follower.point.p_k);
    if (!at) return;
    const Eigen::Matrix<double, 2, 3> J = at->by_point * view.T_c_k.rotation().matrix();
    const Mat2 S = J * follower.point.cov_m2 * J.transpose() + config_.pose_px * config_.pose_px * Mat2::Identity();
    const double reach = std::min(config_.most_px, std::sqrt(config_.gate * S.trace()));
    for (std::size_t c = 0; c < view.corners.size(); ++c) {
      const SeenCorner& corner = view.corners[c];
      const Vec2 r = corner.uv_px - at->uv;
      if (r.squaredNorm() > reach * reach) continue;
      const double m = r.dot((S + corner.cov_px2).inverse() * r);
      if (m > config_.gate) continue;
      double correlation = 0;
      for (std::size_t i = 0; i < corner.patch.size(); ++i) correlation += static_cast<double>(corner.patch[i]) * follower.patch[i];
      if (correlation < config_.least_correlation) continue;
      const double look = (1 - correlation) / config_.look_sigma;
      out.push_back({-0.5 * (m + look * look), f, static_cast<int>(c)});
    }
  }

  void add(int v, int c, Follower& follower) {
    LearntPoint& p = follower.point;
    p.sights.push_back({v, c});
    follower.patch = all_.views[static_cast<std::size_t>(v)].corners[static_cast<std::size_t>(c)].patch;
    const auto located = triangulate(all_.views, p.sights, follower.prior, config_.pose_px);
    follower.located = located && located->rms_px < 2 * config_.most_rms_px;
    if (!located) return;
    p.p_k = located->p_k;
    p.cov_m2 = located->cov_m2;
    p.scatter_px = located->rms_px;
  }

  /// On the line of sight of a corner, at the depth of the surveyed features around it.
  void begin(int v, int c) {
    const View& view = all_.views[static_cast<std::size_t>(v)];
    const Vec2& uv = view.corners[static_cast<std::size_t>(c)].uv_px;
    double weight = 0, z = 0, z1 = 0, z2 = 0, n = 0;
    for (const Feature& f : all_.tanker.features()) {
      const Point<frame::C> p_c = view.T_c_k * all_.tanker.in_body(f);
      const auto at = view.camera->project(p_c);
      if (!at) continue;
      const double w = 1 / ((*at - uv).squaredNorm() + 25);
      weight += w;
      z += w * p_c.xyz.z();
      z1 += p_c.xyz.z();
      z2 += p_c.xyz.z() * p_c.xyz.z();
      n += 1;
    }
    if (n == 0) return;
    z /= weight;
    const double spread = std::max(0.01 * z, std::sqrt(std::max(0.0, z2 / n - (z1 / n) * (z1 / n))));
    const Vec3 ray = view.camera->line_of_sight(view.camera->ideal_from_raw(uv));
    const double across = z / view.camera->intrinsics().fx_px;  // of one pixel, generous: the corners decide
    const Mat3 P_c = across * across * Mat3::Identity() + spread * spread * ray * ray.transpose();
    const Mat3 R_k_c = view.T_c_k.rotation().matrix().transpose();
    Follower f;
    f.prior.p_k = f.point.p_k = view.T_c_k.inverse() * Point<frame::C>(ray * (z / ray.z()));
    f.prior.cov_m2 = f.point.cov_m2 = R_k_c * P_c * R_k_c.transpose();
    f.point.sights.push_back({v, c});
    f.patch = view.corners[static_cast<std::size_t>(c)].patch;
    live_.push_back(std::move(f));
  }

  /// Takes out what was missed more than `most` times in a row; 0: everything.
  void retire(int most) {
    std::vector<Follower> stay;
    for (Follower& f : live_) {
      if (most > 0 && f.misses <= most) stay.push_back(std::move(f));
      else if (good(f)) finished_.push_back(std::move(f.point));
    }
    live_ = std::move(stay);
  }

  [[nodiscard]] bool good(const Follower& f) const {
    return f.located && static_cast<int>(f.point.sights.size()) >= config_.least_sights && f.point.scatter_px <= config_.most_rms_px &&
           extent_.holds(f.point.p_k.xyz, config_.beyond * extent_.size());
  }

  std::vector<LearntPoint> without_doubles() {
    std::stable_sort(finished_.begin(), finished_.end(), [](const LearntPoint& a, const LearntPoint& b) { return a.sights.size() > b.sights.size(); });
    std::vector<LearntPoint> out;
    for (LearntPoint& p : finished_)
      if (std::none_of(out.begin(), out.end(), [&](const LearntPoint& q) { return same(p, q); })) out.push_back(std::move(p));
    return out;
  }

  /// Mean distance of two points in some of the views of the first.
  [[nodiscard]] bool same(const LearntPoint& p, const LearntPoint& q) const {
    double sum = 0;
    int n = 0;
    for (std::size_t i = 0; i < p.sights.size(); i += 1 + p.sights.size() / 5) {
      const View& view = all_.views[static_cast<std::size_t>(p.sights[i].view)];
      const auto a = view.camera->project(view.T_c_k * p.p_k), b = view.camera->project(view.T_c_k * q.p_k);
      sum += a && b ? (*a - *b).norm() : 1e9;
      ++n;
    }
    return sum < config_.same_px * n;
  }

  const Views& all_;
  FollowConfig config_;
  Extent extent_;
  std::vector<Follower> live_;
  std::vector<LearntPoint> finished_;
};

}  // namespace

std::optional<Located> triangulate(const std::vector<View>& views, const std::vector<Sight>& sights, const PointPrior& prior, double pose_px) {
  const Mat3 information = prior.cov_m2.inverse();
  const std::size_t step = 1 + (sights.size() - 1) / kMostUsed;
  Located out{prior.p_k, prior.cov_m2, 0};
  for (int iteration = 0; iteration < 8; ++iteration) {
    Mat3 H = information;
    Vec3 g = -information * (out.p_k - prior.p_k);
    double sum = 0, n = 0;
    for (std::size_t i = 0; i < sights.size(); i += step) {
      const View& view = views[static_cast<std::size_t>(sights[i].view)];
      const SeenCorner& corner = view.corners[static_cast<std::size_t>(sights[i].corner)];
      const auto at = align::projected(*view.camera, view.T_c_k, out.p_k);
      if (!at) return std::nullopt;
      const Eigen::Matrix<double, 2, 3> J = at->by_point * view.T_c_k.rotation().matrix();
      const Mat2 W = (corner.cov_px2 + pose_px * pose_px * Mat2::Identity()).inverse();
      const Vec2 r = corner.uv_px - at->uv;
      const double m = std::sqrt(r.dot(W * r)), weight = iteration < 2 || m < kHuber ? 1 : kHuber / m;
      H += weight * J.transpose() * W * J;
      g += weight * J.transpose() * W * r;
      sum += 0.5 * r.squaredNorm();
      n += 1;
    }
    out.cov_m2 = H.inverse();
    out.rms_px = std::sqrt(sum / std::max(1.0, n));
    const Vec3 change = out.cov_m2 * g;
    if (!change.allFinite()) return std::nullopt;
    out.p_k.xyz += change;
    if (iteration > 2 && change.dot(H * change) < 1e-4) break;
  }
  for (const Sight& s : sights) {
    const View& view = views[static_cast<std::size_t>(s.view)];
    if ((view.T_c_k * out.p_k).xyz.z() <= 0 || !((out.p_k - lens_in_body(view.T_c_k)).norm() > 0)) return std::nullopt;
  }
  return out;
}

std::vector<LearntPoint> follow(const Views& views, const FollowConfig& config) { return Following(views, config).run(); }

void match_all(const std::vector<View>& views, double radius_px, std::vector<LearntPoint>& points) {
  for (LearntPoint& p : points) p.sights.clear();
  std::vector<Pairing> pairings;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const View& view = views[v];
    pairings.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto at = view.camera->project(view.T_c_k * points[i].p_k);
      if (!at) continue;
      for (std::size_t c = 0; c < view.corners.size(); ++c)
        if (const double d2 = (view.corners[c].uv_px - *at).squaredNorm(); d2 < radius_px * radius_px) pairings.push_back({-d2, i, static_cast<int>(c)});
    }
    std::sort(pairings.begin(), pairings.end(), [](const Pairing& a, const Pairing& b) { return a.score > b.score; });
    std::vector<bool> point_done(points.size(), false), corner_done(view.corners.size(), false);
    for (const Pairing& p : pairings) {
      if (point_done[p.follower] || corner_done[static_cast<std::size_t>(p.corner)]) continue;
      point_done[p.follower] = corner_done[static_cast<std::size_t>(p.corner)] = true;
      points[p.follower].sights.push_back({static_cast<int>(v), p.corner});
    }
  }
}

}  // namespace cyclops::tools::learn
