#pragma once
/// The tanker as the chain knows it: named points. Nothing else in Cyclops knows how many there are or of what.
///
/// File   CSV, one feature a line, a header line with column names; `#` begins a comment line.
///        Required columns: id, x, y, z. Optional: name, kind, normals ("nx ny nz; nx ny nz"), sigma, enabled (0/1),
///        cov ("xx xy xz yy yz zz", units squared), seen_from ("x y z deg": a cone of directions from the feature to the camera),
///        seen_range ("least most"); other columns are not read. Units are those of the caller (inch or metre).
/// Threads const use from any.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/frames.hpp"

namespace cyclops {

inline constexpr double kSurveySigma_m = 0.00178;  ///< 0.07 in, spec 3.8

/// Where a camera has to be to see a feature that was learnt: the feature was never seen from elsewhere.
struct SeenFrom {
  Vec3 axis_m{0, 0, 0};          ///< unit, model axes, from the feature to the camera; 0: any direction
  double least_cosine{-1};       ///< of the angle between axis and direction
  double least_m{0}, most_m{1e9};  ///< lens to feature
  /// `to_camera_m`: model axes, m.
  [[nodiscard]] bool holds(const Vec3& to_camera_m) const {
    const double range = to_camera_m.norm();
    return range >= least_m && range <= most_m && axis_m.dot(to_camera_m) >= (axis_m.isZero() ? -1 : least_cosine * range);
  }
};

struct Feature {
  std::int32_t id{0};
  std::string name;
  std::string kind;
  Point<frame::M> p_m{};         ///< m
  std::vector<Vec3> normals_m;   ///< unit, model axes; empty: may be seen from anywhere
  double sigma_m{kSurveySigma_m};  ///< 1 sigma of the survey per axis
  std::optional<Mat3> cov_m2;    ///< model axes; stands instead of sigma_m where it is known
  std::optional<SeenFrom> seen_from;
  bool enabled{true};
};

class TankerModel {
 public:
  /// `metres_per_unit`: 0.0254 for inches. `ins_model`: tanker INS in model units. `sigma_m`: of features that list none. Names line and column of what is wrong.
  static Result<TankerModel> parse(const std::string& csv, const std::string& name, double metres_per_unit, const Vec3& ins_model,
                                   double sigma_m = kSurveySigma_m);
  static Result<TankerModel> load(const std::string& path, double metres_per_unit, const Vec3& ins_model, double sigma_m = kSurveySigma_m);

  [[nodiscard]] const std::vector<Feature>& features() const { return features_; }
  /// p_k = diag(-1, 1, -1) (p_m - m_INS): model is aft-right-up, body forward-right-down. Spec 1.2 step 1.
  [[nodiscard]] Point<frame::K> in_body(const Feature& f) const { return body_from_model(f.p_m); }
  [[nodiscard]] Point<frame::K> body_from_model(const Point<frame::M>& p) const;
  /// R_c_k: camera from tanker body. Covariance of the feature's place in camera axes, m^2.
  [[nodiscard]] static Mat3 covariance_in_camera(const Feature& f, const Mat3& R_c_k);
  [[nodiscard]] static Vec3 direction_in_body(const Vec3& model_direction) { return {-model_direction.x(), model_direction.y(), -model_direction.z()}; }
  [[nodiscard]] const Point<frame::M>& ins() const { return ins_; }

 private:
  std::vector<Feature> features_;
  Point<frame::M> ins_{};
};

}  // namespace cyclops
