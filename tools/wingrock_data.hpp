#pragma once
/// What wing_rock() needs from a flight: image roll of every frame from the measured points of a log, and TSPI's roll at any time.
///
/// TSPI's roll  the model's features are projected by both aircraft's TSPI (rig's lens and mount) and read like the picture:
///              the turn against the same reference shape, for the features that the frame measured.
/// Time         seconds since the first frame. A frame's time is `mid_exposure_gps_ns` of its measurements; where the service
///              did not know GPS time, its own clock less the smallest (arrival - GPS) of the flight's TSPI: late by the
///              fastest transport.
/// Errors       name the file. Threads: one at a time.
#include <memory>
#include <string>

#include "tools/image_roll.hpp"
#include "tools/wingrock.hpp"

namespace cyclops::tools {

class WingRockData {
 public:
  /// `log`: event log with MEASUREMENT, live or of cyclops-offline.
  static Result<std::unique_ptr<WingRockData>> load(const std::string& flight, const std::string& log);
  ~WingRockData();
  [[nodiscard]] const RollSeries& seen() const;  ///< frames with enough features; may be empty
  [[nodiscard]] double roll_at(std::size_t frame, double t_s) const;
  [[nodiscard]] bool by_arrival() const;         ///< frame times were made from arrivals
  [[nodiscard]] double bank_deg(bool tanker, double t_s) const;   ///< of one aircraft, NaN where TSPI does not reach

 private:
  struct State;
  explicit WingRockData(std::unique_ptr<State> state);
  std::unique_ptr<State> s_;
};

}  // namespace cyclops::tools
