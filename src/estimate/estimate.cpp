#include "estimate/estimate.hpp"

namespace cyclops {
namespace {

using Mat23 = Eigen::Matrix<double, 2, 3>;
using Mat36 = Eigen::Matrix<double, 3, 6>;

/// What is the same for all features of one frame.
struct View {
  Mat3 R_r_k;
  Mat3 R_c_r;
  Vec3 t_r;       ///< tanker INS from the lens, receiver axes, m
  const Mat6& navigation;
};

/// One feature on its way to the image.
struct Seen {
  Vec3 lever_r;   ///< tanker INS to feature, receiver axes
  Vec3 p_c;       ///< lens to feature, camera axes
};

Seen look(const View& view, const Vec3& p_k) {
  const Vec3 lever_r = view.R_r_k * p_k;
  return {lever_r, view.R_c_r * (lever_r + view.t_r)};
}

/// Covariance of p_c. True rotation exp(e) R moves a lever p by e x p = -skew(p) e, for navigation and for boresight.
Mat3 point_covariance(const View& view, const Seen& seen, double boresight_sigma, const Mat3& survey) {
  Mat36 J_r;
  J_r << -skew(seen.lever_r), Mat3::Identity();
  const Mat36 J_c = view.R_c_r * J_r;
  const Mat3 S = skew(seen.p_c);
  return J_c * view.navigation * J_c.transpose() + boresight_sigma * boresight_sigma * (S * S.transpose()) + survey;
}

/// A focal length longer by the share e moves a point outward by e times its distance from the principal point.
Vec2 focal_jacobian(const Camera& camera, const Vec2& raw) {
  const Vec2 before_windscreen = camera.windscreen().undistort(raw);
  const Vec2 arm = before_windscreen - Vec2(camera.intrinsics().cx_px, camera.intrinsics().cy_px);
  return arm + camera.windscreen().delta_jacobian(before_windscreen) * arm;
}

bool faces_camera(const View& view, const Feature& feature, const Vec3& p_c) {
  if (feature.normals_m.empty() && !feature.seen_from) return true;
  const Vec3 to_camera_k = -(view.R_c_r * view.R_r_k).transpose() * p_c;
  if (feature.seen_from && !feature.seen_from->holds(TankerModel::direction_in_body(to_camera_k))) return false;
  if (feature.normals_m.empty()) return true;
  for (const Vec3& n : feature.normals_m)
    if (TankerModel::direction_in_body(n).dot(to_camera_k) > 0) return true;
  return false;
}

Visibility visibility(const View& view, const Feature& feature, const Camera& camera, const EstimateConfig& config,
                      const Vec3& p_c, const Vec2& uv) {
  if (!feature.enabled) return Visibility::kDisabled;
  if (!camera.inside(uv)) return Visibility::kOutsideImage;
  if (config.use_normals && !faces_camera(view, feature, p_c)) return Visibility::kFacingAway;
  return Visibility::kVisible;
}

Prediction predict_one(const View& view, const Feature& feature, const Vec3& p_k, const Camera& camera,
                       double boresight_sigma, const EstimateConfig& config) {
  Prediction out;
  out.id = feature.id;
  const Seen seen = look(view, p_k);
  out.range_m = seen.p_c.norm();
  Mat23 J;
  const auto uv = camera.project(Point<frame::C>(seen.p_c), J);
  if (!uv) {
    out.visibility = Visibility::kBehindCamera;
    return out;
  }
  out.uv_px = *uv;
  out.visibility = visibility(view, feature, camera, config, seen.p_c, *uv);
  const Vec2 f = config.focal_sigma * focal_jacobian(camera, *uv);
  const Mat3 survey = config.survey_scale * config.survey_scale * TankerModel::covariance_in_camera(feature, view.R_c_r * view.R_r_k);
  const Mat3 P_c = point_covariance(view, seen, boresight_sigma, survey);
  out.cov_px2 = J * P_c * J.transpose() + f * f.transpose() +
                config.windscreen_sigma_px * config.windscreen_sigma_px * Mat2::Identity();
  return out;
}

}  // namespace

Result<EstimateConfig> EstimateConfig::read(ConfigTable& table, EstimateConfig c) {
  table.read("use_normals", c.use_normals);
  table.read_in("focal_sigma", 0.0, 0.1, c.focal_sigma);
  table.read_in("windscreen_sigma_px", 0.0, 100.0, c.windscreen_sigma_px);
  table.read_in("survey_scale", 0.0, 100.0, c.survey_scale);
  return c;
}

void predict(const RelativeState& state, const TankerModel& model, const Camera& camera, const CameraMount& mount,
             const EstimateConfig& config, PredictionSet& out) {
  out.t_mid = state.t;
  out.from_nav = state.valid;
  out.items.clear();
  if (!state.valid) return;
  const View view{state.T_r_k.rotation().matrix(), mount.R_c_r.matrix(), state.T_r_k.translation() - mount.lens, state.covariance};
  for (const Feature& feature : model.features()) {
    Prediction p = predict_one(view, feature, model.in_body(feature).xyz, camera, mount.boresight_sigma_rad, config);
    p.feature = static_cast<std::uint16_t>(out.items.size());
    out.items.push_back(p);
  }
}

void displace(const RelativeState& before, const RelativeState& now, const TankerModel& model, const Camera& camera, const CameraMount& mount,
              RigidMotion& out) {
  out.items.clear();
  const Pose<frame::C, frame::R> T_c_r(mount.R_c_r, Point<frame::C>(-mount.R_c_r.rotate(mount.lens.xyz)));
  const Pose<frame::C, frame::K> then = T_c_r * before.T_r_k, here = T_c_r * now.T_r_k;
  for (const Feature& feature : model.features()) {
    const Point<frame::K> p_k = model.in_body(feature);
    const auto from = camera.project(then * p_k), to = camera.project(here * p_k);
    out.items.push_back(from && to ? Displacement{true, *to - *from} : Displacement{});
  }
}

}  // namespace cyclops
