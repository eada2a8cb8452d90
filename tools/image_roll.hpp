#pragma once
/// How far the tanker is rolled in the picture, from image points alone: no attitude takes part.
///
/// Reading    the turn of the similarity (shift, scale, turn) that best lays the reference shape onto the points of a frame.
/// Reference  the mean shape of the flight's own points: shapes are laid onto one another in turn until they settle
///            (generalised Procrustes analysis, Gower 1975); features may come and go.
/// Points     on the image plane, distortion removed, x right and y down, one unit of length for all: clockwise is positive.
/// Sigma      1 sigma of a reading from the scatter of its own points; it does not know what all points do together.
/// Threads    any for const use. Errors: kNotFound without two frames of enough points.
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "base/result.hpp"
#include "geometry/frames.hpp"

namespace cyclops::tools {

struct ShapePoint {
  int feature{0};
  Vec2 xy{0, 0};
};
using Shape = std::vector<ShapePoint>;

struct RollReading {
  double roll_rad{0};
  double sigma_rad{0};
};

class RollReference {
 public:
  static constexpr std::size_t kFewest = 5;      ///< points of a shape
  static Result<RollReference> from(std::span<const Shape> frames);
  /// Nothing for fewer than kFewest points of the reference.
  [[nodiscard]] std::optional<RollReading> roll(const Shape& shape) const;

 private:
  struct Fit {
    Vec2 from{0, 0}, to{0, 0};                   // centroids
    double a{1}, b{0};                           // to = from turned: x' = a x - b y, y' = b x + a y
    double rms{0}, size{0};                      // residual, and root sum of squares of the reference points about their centroid
    std::size_t n{0};
  };
  [[nodiscard]] std::optional<Fit> fit(const Shape& shape) const;
  std::map<int, Vec2> mean_;
};

}  // namespace cyclops::tools
