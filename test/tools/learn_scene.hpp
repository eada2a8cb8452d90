#pragma once
/// A made-up tanker of points, seen from a camera that flies around below it: what learning is tested on.
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "test/support.hpp"
#include "tools/learn_types.hpp"

namespace cyclops::test {

namespace learn = tools::learn;

struct LearnScene {
  static constexpr int kSurveyed = 8;       ///< the first points are surveyed features too
  double corner_px{0.2};                    ///< 1 sigma of a corner, an axis
  double pose_rad{0.002}, pose_m{0.02};     ///< 1 sigma of an aligned pose
  double survey_m{0.002};
  int clutter{10};                          ///< corners a view that belong to nothing, or to the sky
  Random random{7};
  std::vector<Point<frame::K>> points;      ///< true places
  std::vector<align::CameraPose> poses;     ///< true, one a view
  learn::Views views;

  explicit LearnScene(int count = 40) {
    for (int i = 0; i < count; ++i) points.emplace_back(uniform(-6, 6), uniform(-8, 8), uniform(-2, 2));
    Intrinsics k;
    k.k1 = -0.05;
    views.cameras.push_back(std::make_unique<Camera>(k, Windscreen{}));
    views.flights = {"made-up"};
  }

  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); }
  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(random); }
  Vec3 normal3(double sigma) { return {normal(sigma), normal(sigma), normal(sigma)}; }

  /// Camera from tanker in view v of n: nearing from 30 to 18 m, swaying to the side and in height.
  static align::CameraPose pose_at(int v, int n) {
    const double s = static_cast<double>(v) / n, sway = std::sin(9 * s);
    const Rotation<frame::C, frame::K> R(Mat3(rotation_y(0.25 * sway) * rotation_x(0.35 + 0.15 * std::cos(7 * s))) * camera_from_receiver({}).matrix());
    return {R, Point<frame::C>(1.5 * sway, 0.5 * std::cos(5 * s), 30 - 12 * s)};
  }

  /// Own surroundings for each point, so that it looks like itself and nothing else.
  static learn::Patch patch_of(std::uint64_t seed) {
    Random r(seed);
    std::normal_distribution<float> normal(0, 1);
    learn::Patch p;
    float sum2 = 0;
    for (float& x : p) {
      x = normal(r);
      sum2 += x * x;
    }
    for (float& x : p) x /= std::sqrt(sum2);
    return p;
  }

  /// Surveyed features with the survey's error, views with the errors of aligned poses, corners with theirs.
  void fly(int n) {
    std::string csv = "id,x,y,z,sigma\n";
    for (int i = 0; i < std::min<int>(kSurveyed, static_cast<int>(points.size())); ++i) {
      const Vec3 p = TankerModel::direction_in_body(points[static_cast<std::size_t>(i)].xyz) + normal3(survey_m);
      csv += std::to_string(i + 1) + "," + std::to_string(p.x()) + "," + std::to_string(p.y()) + "," + std::to_string(p.z()) + "," + std::to_string(survey_m) + "\n";
    }
    views.tanker = TankerModel::parse(csv, "scene.csv", 1, {0, 0, 0}).value();
    for (int v = 0; v < n; ++v) {
      poses.push_back(pose_at(v, n));
      learn::View view{0, 0.2 * v, views.cameras[0].get(), {}, Mat6::Identity(), {}};
      align::Vec6 error;
      error.head<3>() = normal3(pose_rad);
      error.tail<3>() = normal3(pose_m);
      view.T_c_k = align::moved(poses.back(), error);
      view.covariance.diagonal() << Vec3::Constant(pose_rad * pose_rad), Vec3::Constant(pose_m * pose_m);
      for (std::size_t i = 0; i < points.size(); ++i) see(view, poses.back() * points[i], patch_of(i));
      for (int c = 0; c < clutter; ++c) view.corners.push_back({{uniform(0, 1023), uniform(0, 1023)}, Mat2::Identity() * 0.01, patch_of(random())});
      views.views.push_back(std::move(view));
    }
  }

  void see(learn::View& view, const Point<frame::C>& p_c, const learn::Patch& patch) {
    const auto uv = view.camera->project(p_c);
    if (uv && view.camera->inside(*uv)) view.corners.push_back({*uv + Vec2(normal(corner_px), normal(corner_px)), corner_px * corner_px * Mat2::Identity(), patch});
  }

  /// Points that start near the truth, with the corners that are theirs: no search, only the adjustment is tried.
  std::vector<learn::LearntPoint> matched(double off_m) {
    std::vector<learn::LearntPoint> out;
    for (std::size_t i = 0; i < points.size(); ++i) {
      learn::LearntPoint p;
      p.p_k = Point<frame::K>(points[i].xyz + normal3(off_m));
      p.scatter_px = corner_px;
      p.survey = i < kSurveyed ? static_cast<int>(i) : -1;
      const learn::Patch own = patch_of(i);
      for (std::size_t v = 0; v < views.views.size(); ++v)
        for (std::size_t c = 0; c < views.views[v].corners.size(); ++c)
          if (views.views[v].corners[c].patch == own) p.sights.push_back({static_cast<int>(v), static_cast<int>(c)});
      out.push_back(std::move(p));
    }
    return out;
  }
};

}  // namespace cyclops::test
