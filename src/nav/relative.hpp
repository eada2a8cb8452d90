#pragma once
/// The tanker's INS in receiver body axes, from the states of both aircraft at one time.
///
///   R_r_k = R_e_r^T R_e_k                                   composed, never a difference of Euler angles (spec E5)
///   t_r_k = R_e_r^T (p_k - p_r) + R_r_k l_k - l_r           l: lever arm from the TSPI point to the INS, body axes
///   w_r   = R_r_k w_k - w_r                                 dR_r_k/dt = [w_r] R_r_k
///   v_r   = R_e_r^T (v_k - v_r) - w_r x (t_r_k + l_r) + R_r_k (w_k x l_k)
/// Covariance, first order in the attitude errors dr, dk (body axes) and the position errors er, ek (ECEF), order
/// [rotation; translation] as in msg/tspi.hpp:
///   rotation     = -dr + R_r_k dk
///   translation  = [t_r_k + l_r] dr - R_r_k [l_k] dk + R_e_r^T (ek - er)
/// The attitude errors of the two aircraft are independent; their position errors have NavConfig::position_correlation.
/// Checked against numerical derivatives and by Monte Carlo in test/nav/relative_test.cpp.
/// Threads  pure. Memory: no heap.
#include "nav/motion.hpp"

namespace cyclops {

/// Fills T_r_k, covariance, velocity_r and rate_r. `t_sigma`, 1 sigma of the common time, adds what moves within it.
[[nodiscard]] RelativeState relative_state(const AircraftState& receiver, const AircraftState& tanker, const NavRig& rig,
                                           double position_correlation, Duration t_sigma);

}  // namespace cyclops
