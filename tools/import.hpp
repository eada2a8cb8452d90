#pragma once
/// A folder of pictures with poses becomes a flight: the priors turn into TSPI of two aircraft, so that the whole live path is used.
///
/// Folder     frames/*.png|pgm (8 or 16 bits a sample), camera.json, features.csv (id, x_m, y_m, z_m, [label], [normals]),
///            prior*.csv (frame, timestamp_s, x, y, z, qw, qx, qy, qz, nav_update): the model in the camera frame,
///            X_c = R(q) X_m + t, camera right-down-forward; optional truth.csv (frame, id, u_px, v_px, visible 0, 1, 2 = do not score).
/// Receiver   flies north at 100 m/s from 35 N 118 W, level at the first frame; the camera looks along its nose from its INS.
///            An hour at most, as it flies straight and the earth does not.
/// Tanker     its INS is the mean of the features; one TSPI sample of each aircraft at each frame's mid-exposure time.
/// Sigmas     of the prior: `prior_sigma_px` on the image, three times that in depth, half of it in rotation at the tanker's
///            radius. 0: estimated from the scatter of the prior itself, see estimate_sigma_px in import_readers.hpp.
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/result.hpp"

namespace cyclops::tools {

struct ImportOptions {
  std::string folder;
  std::string prior{"prior.csv"};
  std::string truth{"truth.csv"};   ///< in the folder; absent is no error unless given by the user
  bool truth_required{false};
  std::string out;
  double rate_hz{30};               ///< only when the prior has no timestamps
  double prior_sigma_px{0};
  bool replace{true};
};

struct ImportReport {
  std::int64_t frames{0};
  int width{0}, height{0};
  bool sixteen_bit{false};
  bool from_colour{false};
  std::size_t features{0};
  bool has_truth{false};
  std::int64_t frames_without_truth{0};  ///< frames without a row in truth.csv; 0 when there is no such file
  int nav_every_n{1};
  double sigma_px{0};               ///< prior sigma used, px per axis
};

/// All but the pictures is read before anything is written; what a later error leaves in `out` is no flight.
/// Errors   those of import_readers.hpp and record/flight.hpp; kNotFound: a pose without a picture; kInvalid: pictures of 8 and of
///          16 bits, or a model behind the camera.
/// Threads  one a folder `out`.
Result<ImportReport> import_folder(const ImportOptions& options);

}  // namespace cyclops::tools
