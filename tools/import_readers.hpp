#pragma once
/// The files of a folder of pictures with poses, read and checked one by one; columns and keys: import.hpp.
///
/// Units    m, px; times in ns since the folder's timestamp 0.
/// Frames   c camera optical, m model of features.csv; (0,0) is the centre of the top-left pixel.
/// Errors   name the file, with the line where it has lines, the value and what was expected. kNotFound: no such file, no picture.
///          kCorrupt: does not parse, or a row disagrees with the rows before. kInvalid: parses, but does not fit the rest.
///          kTruncated: no row. kUnsupported: longer than an hour, or other than 8 or 16 bits a sample.
/// Threads  stateless: any thread.
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "base/result.hpp"
#include "geometry/camera.hpp"
#include "geometry/frames.hpp"
#include "geometry/tanker_model.hpp"
#include "tools/import.hpp"

namespace cyclops::tools {

struct PriorPose {
  std::int64_t frame{0};
  std::int64_t t_ns{0};              ///< mid-exposure
  Pose<frame::C, frame::M> T_c_m{};
  bool nav_update{true};
};

struct TruthPoint {
  std::int32_t id{0};
  double u_px{0}, v_px{0};
  int visible{1};                    ///< 0, 1; 2 = do not score
};
using TruthByFrame = std::map<std::int64_t, std::vector<TruthPoint>>;

using PictureByFrame = std::map<std::int64_t, std::string>;  ///< path of each frame's picture

struct GreyPicture {
  cv::Mat samples;                   ///< one channel, CV_8U or CV_16U, rows x columns of the camera
  bool from_colour{false};
};

/// All of the folder but the pictures.
struct Folder {
  Intrinsics k;
  std::string features_csv;            ///< as it is in the file
  TankerModel model;
  std::vector<PriorPose> prior;        ///< not empty
  PictureByFrame pictures;             ///< a pose may be without
  std::optional<TruthByFrame> truth;   ///< nothing: no such file
};

/// camera.json, features.csv, prior, list of frames/, truth, in this order; the first error ends it. The prior may also lie outside
/// the folder; the truth is left out when absent, unless the options require it.
Result<Folder> read_folder(const ImportOptions& options);

/// Pinhole and lens from camera.json; width and height 16 to 4096 px, fx and fy above 0, lens terms 0 when absent.
Result<Intrinsics> read_camera(const std::string& path);

/// At least one pose; frames and times rise from row to row. `rate_hz`: only when there is no column timestamp_s.
Result<std::vector<PriorPose>> read_prior(const std::string& path, double rate_hz);

/// A frame without a row is not in the map.
Result<TruthByFrame> read_truth(const std::string& path);

/// The .png and .pgm files of `folder`/frames by the number that ends their name, or by their place in order of names without one.
Result<PictureByFrame> list_pictures(const std::string& folder);

/// Grey samples as they are in the file; colour is made grey. The size must be that of the camera.
Result<GreyPicture> read_picture(const std::string& path, const Intrinsics& k);

/// 1 sigma, px an axis, of the prior's noise that is not motion: median second difference of the projected `middle`, taken as the
/// white fifth of the variance of a prior whose other four fifths vary slowly. 1.5 to 15; 6 when fewer than 8 differences are there.
double estimate_sigma_px(const std::vector<PriorPose>& prior, const Camera& camera, const Point<frame::M>& middle);

}  // namespace cyclops::tools
