#include "tools/learn_axes.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace cyclops::tools::learn {
namespace {

using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;
using Mat37 = Eigen::Matrix<double, 3, 7>;  // by turn, shift, scale

constexpr int kSteps = 6, kIterations = 5;
const double kNoPair = std::exp(-0.5 * 9);  // a vote beyond three sigma is none

struct Pair {
  int feature{0};
  Vec3 survey{0, 0, 0}, point{0, 0, 0};
  Mat3 W{Mat3::Zero()};   // px^2/m^2, mean over views
  double distance_m{0};   // to the camera
};

Mat37 by_change(const Vec3& p) {
  Mat37 A;
  A << -skew(p), Mat3::Identity(), p;
  return A;
}

/// What a metre of the point is in pixels, averaged over some of its views.
void weigh(const std::vector<View>& views, const LearntPoint& p, Pair& pair) {
  int n = 0;
  for (std::size_t i = 0; i < p.sights.size(); i += 1 + p.sights.size() / 8) {
    const View& view = views[static_cast<std::size_t>(p.sights[i].view)];
    const auto at = align::projected(*view.camera, view.T_c_k, p.p_k);
    if (!at) continue;
    const Eigen::Matrix<double, 2, 3> J = at->by_point * view.T_c_k.rotation().matrix();
    pair.W += J.transpose() * J;
    pair.distance_m += (view.T_c_k * p.p_k).xyz.norm();
    ++n;
  }
  pair.W /= std::max(1, n);
  pair.distance_m /= std::max(1, n);
}

std::vector<Pair> pairs_of(const Views& views, const std::vector<LearntPoint>& points, double most_px) {
  std::vector<Pair> out;
  const auto& features = views.tanker.features();
  for (std::size_t f = 0; f < features.size(); ++f) {
    if (!features[f].enabled) continue;
    const Point<frame::K> place = views.tanker.in_body(features[f]);
    for (const LearntPoint& p : points) {
      if (p.sights.empty() || mean_distance_px(views.views, p, place) > most_px) continue;
      Pair pair{static_cast<int>(f), place.xyz, p.p_k.xyz, Mat3::Zero(), 0};
      weigh(views.views, p, pair);
      out.push_back(pair);
    }
  }
  return out;
}

double square_px2(const Pair& pair, const Vec7& x) {
  const Vec3 e = pair.survey - pair.point - by_change(pair.point) * x;
  return e.dot(pair.W * e);
}

/// Each feature shares its vote among its points.
std::vector<double> votes(const std::vector<Pair>& pairs, const Vec7& x, double sigma_px) {
  std::vector<double> w(pairs.size());
  std::vector<double> sum;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    w[i] = std::exp(-0.5 * square_px2(pairs[i], x) / (sigma_px * sigma_px));
    sum.resize(std::max(sum.size(), static_cast<std::size_t>(pairs[i].feature) + 1), kNoPair);
    sum[static_cast<std::size_t>(pairs[i].feature)] += w[i];
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) w[i] /= sum[static_cast<std::size_t>(pairs[i].feature)];
  return w;
}

}  // namespace

double mean_distance_px(const std::vector<View>& views, const LearntPoint& p, const Point<frame::K>& q) {
  double sum = 0;
  int n = 0;
  for (std::size_t i = 0; i < p.sights.size(); i += 1 + p.sights.size() / 8) {
    const View& view = views[static_cast<std::size_t>(p.sights[i].view)];
    const auto a = view.camera->project(view.T_c_k * p.p_k), b = view.camera->project(view.T_c_k * q);
    sum += a && b ? (*a - *b).norm() : 1e9;
    ++n;
  }
  return n == 0 ? 1e9 : sum / n;
}

AxesChange find_axes(const Views& views, const std::vector<LearntPoint>& points, const AxesConfig& config) {
  const std::vector<Pair> pairs = pairs_of(views, points, config.pair_px);
  AxesChange out;
  if (pairs.empty()) return out;
  double distance = 0;
  for (const Pair& p : pairs) distance += p.distance_m / static_cast<double>(pairs.size());
  Vec7 prior;
  prior << Vec3::Constant(std::pow(config.turn_rad, -2)), Vec3::Constant(std::pow(config.shift_share * distance, -2)), std::pow(config.scale, -2);
  Vec7 x = Vec7::Zero();
  for (int step = 0; step < kSteps; ++step) {
    const double sigma = config.first_px * std::pow(config.last_px / config.first_px, static_cast<double>(step) / (kSteps - 1));
    for (int i = 0; i < kIterations; ++i) {
      const std::vector<double> w = votes(pairs, x, sigma);
      Mat7 H = prior.asDiagonal();
      Vec7 g = Vec7::Zero();
      for (std::size_t k = 0; k < pairs.size(); ++k) {
        const Mat37 A = by_change(pairs[k].point);
        const Eigen::Matrix<double, 7, 3> AW = w[k] / (sigma * sigma) * A.transpose() * pairs[k].W;
        H += AW * A;
        g += AW * (pairs[k].survey - pairs[k].point);
      }
      x = H.ldlt().solve(g);
    }
  }
  std::set<int> agree;
  for (const Pair& p : pairs)
    if (square_px2(p, x) < config.agree_px * config.agree_px) agree.insert(p.feature);
  out.agree = static_cast<int>(agree.size());
  if (out.agree < config.least_agree || !x.allFinite()) return out;
  out.turn_rad = x.head<3>();
  out.shift_m = x.segment<3>(3);
  out.scale = 1 + x[6];
  return out;
}

void move_axes(const AxesChange& change, Views& views, std::vector<LearntPoint>& points) {
  const Rotation<frame::K, frame::K> R(so3_exp(change.turn_rad));
  for (LearntPoint& p : points) p.p_k = Point<frame::K>(change.scale * R.rotate(p.p_k.xyz) + change.shift_m);
  for (View& v : views.views) {
    const Rotation<frame::C, frame::K> R_c_k = v.T_c_k.rotation() * R.inverse();
    v.T_c_k = {R_c_k, Point<frame::C>(change.scale * v.T_c_k.translation().xyz - R_c_k.rotate(change.shift_m))};
  }
}

}  // namespace cyclops::tools::learn
