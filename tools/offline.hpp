#pragma once
/// A flight through the same stages as the service, without a socket, clock or thread: same bits at every run.
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "base/histogram.hpp"
#include "service/chain.hpp"
#include "service/profile.hpp"

namespace cyclops::tools {

struct OfflineResult {
  std::int64_t frames{0};
  std::int64_t frames_out{0};
  std::int64_t refused_messages{0};    ///< did not decode; the first is in `first_refusal`
  std::string first_refusal;
  std::int64_t without_pixels{0};      ///< frames of a recorded flight whose pixels are not there
  std::int64_t first_without_pixels{0};  ///< its seq; from there on results differ from what was published
  Histogram stage[kStages];
  Histogram chain;
  double run_s{0};                     ///< wall time of the whole run
  double flight_s{0};                  ///< time from first to last frame
};

/// Sees each frame after the chain; the image is empty when its pixels are missing. Both are gone after the call.
using FrameObserver = std::function<void(const Rig&, const FrameOutput&, const ImageView&)>;

struct OfflineOptions {
  std::string tanker{};                   ///< a model file to use instead of the flight's own
  std::string looks{};                    ///< and looks of its features
  std::int64_t most_frames{std::numeric_limits<std::int64_t>::max()};  ///< ends early after so many
};

/// Results go to `log`, an event log as the service's messages would make it. `progress` is told the share done, or empty.
Result<OfflineResult> run_offline(const std::string& flight, const Profile& profile, const std::string& log,
                                  const std::function<void(double)>& progress, const FrameObserver& observe = {}, const OfflineOptions& options = {});

/// Measurements as a table: frame, times, id, accepted, reason, pixels, metres, covariance, innovation, NIS.
/// `logs`: the parts of one log. Returns the number of rows.
Result<std::int64_t> measurements_csv(const std::vector<std::string>& logs, const std::string& path);

}  // namespace cyclops::tools
