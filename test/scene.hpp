#pragma once
/// The worked example of spec 1.7 and what else several tests of the chain look at.
#include <string>

#include "estimate/estimate.hpp"

namespace cyclops::test {

inline constexpr double kDeg = 3.14159265358979323846 / 180;

/// Tanker body in receiver body from yaw, pitch, roll in deg (3-2-1) and the INS-to-INS vector in m.
inline RelativeState relative_state(const Vec3& yaw_pitch_roll_deg, const Vec3& t_r_m) {
  RelativeState state;
  state.valid = true;
  const Vec3 a = yaw_pitch_roll_deg * kDeg;
  const Mat3 R = rotation_z(a.x()) * rotation_y(a.y()) * rotation_x(a.z());
  state.T_r_k = {Rotation<frame::R, frame::K>(R), Point<frame::R>(t_r_m)};
  return state;
}

inline CameraMount mount_deg(double pan, double tilt, double roll, const Vec3& lens_r_m) {
  return {camera_from_receiver({pan * kDeg, tilt * kDeg, roll * kDeg}), Point<frame::R>(lens_r_m), 0};
}

inline RelativeState example_state() { return relative_state({2, -1, 3}, {33.324658264, 0.110939934, -5.448886999}); }
inline CameraMount example_mount() { return mount_deg(0, 16, 0, {2.40, -0.15, -0.60}); }
inline TankerModel example_model() {
  return TankerModel::parse("id,x,y,z\n2,539,0,131\n1,520,108,235\n3,520,-108,235\n15,300,318,120\n22,300,-318,120\n29,230,100,100\n",
                            "example", 0.0254, {190, 0, 95}).value();
}

/// Spec 2.2: delta_row = 2 + 4 v^2 u, delta_col = -1 + 3 u^3 at every pixel.
inline Windscreen example_windscreen() {
  std::vector<float> du, dv;
  for (int i = 0; i < 1024; ++i)
    for (int j = 0; j < 1024; ++j) {
      const double u = (j - 511.5) / 511.5, v = (i - 511.5) / 511.5;
      dv.push_back(static_cast<float>(2 + 4 * v * v * u));
      du.push_back(static_cast<float>(-1 + 3 * u * u * u));
    }
  return Windscreen::from_grids(1024, 1024, 1, du, dv).value();
}

}  // namespace cyclops::test
