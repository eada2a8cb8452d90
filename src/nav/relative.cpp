#include "nav/relative.hpp"

namespace cyclops {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat63 = Eigen::Matrix<double, 6, 3>;

/// Covariance of ek - er. Only what the samples brought is correlated, not what motion added since.
Mat3 position_difference(const AircraftState& r, const AircraftState& k, double correlation) {
  const Mat3 cross = correlation * k.position_root_e * r.position_root_e;
  return r.position_cov_e + k.position_cov_e - cross - cross.transpose();
}

}  // namespace

RelativeState relative_state(const AircraftState& receiver, const AircraftState& tanker, const NavRig& rig,
                             double position_correlation, Duration t_sigma) {
  const Rotation<frame::E, frame::R> R_e_r(receiver.q_e_b);
  const Rotation<frame::E, frame::K> R_e_k(tanker.q_e_b);
  const Rotation<frame::R, frame::E> R_r_e = R_e_r.inverse();
  const Rotation<frame::R, frame::K> R_r_k = R_r_e * R_e_k;
  const Vec3& l_r = rig.receiver_ins_from_tspi_m;
  const Vec3& l_k = rig.tanker_ins_from_tspi_m;
  const Vec3 arm = R_r_e.rotate(tanker.position - receiver.position) + R_r_k.rotate(l_k);  // TSPI point of r to INS of k
  RelativeState out;
  out.T_r_k = Pose<frame::R, frame::K>(R_r_k, Point<frame::R>(arm - l_r));
  out.rate_r = R_r_k.rotate(tanker.rate_b) - receiver.rate_b;
  out.velocity_r = R_r_e.rotate(tanker.velocity_e - receiver.velocity_e) - receiver.rate_b.cross(arm) +
                   R_r_k.rotate(tanker.rate_b.cross(l_k));

  const Mat3 R = R_r_k.matrix();
  const Mat3 R_re = R_r_e.matrix();
  Mat63 by_receiver, by_tanker;
  by_receiver.topRows<3>() = -Mat3::Identity();
  by_receiver.bottomRows<3>() = skew(arm);
  by_tanker.topRows<3>() = R;
  by_tanker.bottomRows<3>() = -R * skew(l_k);
  out.covariance = by_receiver * receiver.attitude_cov_b * by_receiver.transpose() +
                   by_tanker * tanker.attitude_cov_b * by_tanker.transpose();
  out.covariance.bottomRightCorner<3, 3>() +=
      R_re * position_difference(receiver, tanker, position_correlation) * R_re.transpose();
  Vec6 per_second;
  per_second.head<3>() = out.rate_r;
  per_second.tail<3>() = out.velocity_r;
  const double sigma = t_sigma.seconds();
  out.covariance += (sigma * sigma) * per_second * per_second.transpose();
  out.covariance = (0.5 * (out.covariance + out.covariance.transpose())).eval();
  return out;
}

}  // namespace cyclops
