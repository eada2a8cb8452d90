#pragma once
/// The sizes that bound every store on the hot path.
#include <cstddef>

namespace cyclops {

inline constexpr std::size_t kMaxFeatures = 1024;   ///< features of one tanker model
inline constexpr std::size_t kMaxSubImages = 1024;  ///< at most one a feature
inline constexpr std::size_t kMaxCorners = 16384;   ///< corners of one frame
inline constexpr int kMaxImageSide = 4096;          ///< px

}  // namespace cyclops
