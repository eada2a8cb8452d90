#pragma once
/// A copy of a flight with something wrong in it: what navigation says, or what the camera sees. For the trials of `make evaluate`.
///
/// Times    seconds after the mid-exposure of the copy's first frame; navigation is disturbed from `at_s` until `at_s` + `for_s`.
/// Frames   numbers from 1. Pixels are shared with the original (hard link) unless frames are occluded; only then can the copy be shorter.
/// Truth    stays what it is; an occluded feature is hidden.
/// Errors   those of reading and writing a flight; a frame that is not there.
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace cyclops::tools {

struct Occlusion {
  int first{0}, last{0};             ///< frames of the original, both included
};

struct Disturbance {
  double at_s{0};
  double for_s{std::numeric_limits<double>::infinity()};
  double position_m{0};              ///< the tanker's position is off by this, in a direction drawn from `seed`
  double attitude_deg{0};            ///< its attitude too, about an axis that is drawn
  double position_sigma_m{0};        ///< above 0: stated per axis in place of what is said
  double attitude_sigma_deg{0};
  bool frozen{false};                ///< the tanker's reports stand still while their time goes on
  std::int64_t seed{1};
  int last_frame{std::numeric_limits<int>::max()};  ///< needs an occlusion
  std::vector<Occlusion> occlusions;  ///< frames that show sky alone: pixels drawn from the frame's own top rows
};

Result<> disturb_flight(const std::string& from, const std::string& to, const Disturbance& how);

}  // namespace cyclops::tools
