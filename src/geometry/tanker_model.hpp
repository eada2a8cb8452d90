#pragma once
/// The tanker as the chain knows it: named points. Nothing else in Cyclops knows how many there are or of what.
///
/// File   CSV, one feature a line, a header line with column names; `#` begins a comment line.
///        Required columns: id, x, y, z. Optional: name, kind, normals ("nx ny nz; nx ny nz"), sigma, enabled (0/1),
///        provenance columns of any other name are kept out. Units are those of the caller (inch or metre).
/// Threads const use from any.
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/frames.hpp"

namespace cyclops {

inline constexpr double kSurveySigma_m = 0.00178;  ///< 0.07 in, spec 3.8

struct Feature {
  std::int32_t id{0};
  std::string name;
  std::string kind;
  Point<frame::M> p_m{};         ///< m
  std::vector<Vec3> normals_m;   ///< unit, model axes; empty: may be seen from anywhere
  double sigma_m{kSurveySigma_m};  ///< 1 sigma of the survey per axis
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
  [[nodiscard]] static Vec3 direction_in_body(const Vec3& model_direction) { return {-model_direction.x(), model_direction.y(), -model_direction.z()}; }
  [[nodiscard]] const Point<frame::M>& ins() const { return ins_; }

 private:
  std::vector<Feature> features_;
  Point<frame::M> ins_{};
};

}  // namespace cyclops
