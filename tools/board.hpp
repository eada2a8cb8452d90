#pragma once
/// What was heard on LCM: the newest of each kind and when it came. What cyclops-top and cyclops-web show.
///
/// Time     `now_ns` is this host's steady clock; ages are against it, never against stamps in messages.
/// Errors   take() is false for a message that cannot be decoded; it is counted and nothing changes. Generated decoders
///          believe lengths: the programs limit their address space, so that a lie costs an exception, caught here.
/// Threads  one at a time.
#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>

#include <cyclops/clock_state_t.hpp>
#include <cyclops/event_t.hpp>
#include <cyclops/frame_index_t.hpp>
#include <cyclops/health_t.hpp>
#include <cyclops/measurement_set_t.hpp>
#include <cyclops/prediction_set_t.hpp>
#include <cyclops/track_set_t.hpp>

namespace cyclops::tools {

/// One HEALTH as plotted.
struct Sample {
  std::int64_t t_ns{0};              ///< came at
  float range_m, closure_mps, frame_rate_hz, latency_p99_ms, residual_px, time_sigma_us, silence_receiver_ms, silence_tanker_ms;
  int matched, visible;
  std::int64_t lost;
  int alarms;
};

struct HeardEvent {
  std::int64_t t_ns{0};
  event_t event{};
};

/// One frame whose parts belong together.
struct Picture {
  std::int64_t seq{-1};
  frame_index_t frame{};
  prediction_set_t prediction{};
  track_set_t track{};
  measurement_set_t measurement{};
};

class Board {
 public:
  static constexpr std::size_t kEvents = 200;
  static constexpr std::size_t kSamples = 3000;      ///< ten minutes at 5 Hz
  static constexpr double kStale_s = 1.0;            ///< HEALTH comes at 5 Hz: older is stale

  /// `channel` as heard. True: understood. Channels that are none of ours are not counted.
  bool take(std::string_view channel, const void* data, std::size_t size, std::int64_t now_ns);

  [[nodiscard]] const std::optional<health_t>& health() const { return health_; }
  [[nodiscard]] const std::optional<clock_state_t>& clock() const { return clock_; }   ///< newest CLOCK
  /// Seconds since the newest HEALTH, or since the first call of any kind when none has come.
  [[nodiscard]] double health_age_s(std::int64_t now_ns) const;
  [[nodiscard]] bool stale(std::int64_t now_ns) const { return !health_ || health_age_s(now_ns) > kStale_s; }
  [[nodiscard]] const std::deque<HeardEvent>& events() const { return events_; }        ///< newest last
  [[nodiscard]] const std::deque<Sample>& samples() const { return samples_; }          ///< newest last
  [[nodiscard]] const Picture& newest() const { return whole_; }                        ///< newest frame that is whole; seq -1: none
  [[nodiscard]] const Picture& thumbnail() const { return thumbnail_; }                 ///< newest whole frame with a thumbnail
  [[nodiscard]] std::int64_t health_lost() const { return health_lost_; }               ///< gaps in its numbers
  [[nodiscard]] std::int64_t refused() const { return refused_; }
  /// The alarm on this field of HEALTH, or null.
  [[nodiscard]] const alarm_t* alarm_on(std::string_view quantity) const;
  /// A counter of HEALTH by name; 0 when there is none.
  [[nodiscard]] std::int64_t counter(std::string_view name) const;

 private:
  void on_health(std::int64_t now_ns);
  void on_measurement();

  std::optional<health_t> health_;
  health_t scratch_{};
  std::optional<clock_state_t> clock_;
  std::int64_t t_health_ns_{0};
  std::int64_t t_first_ns_{0};
  std::int64_t health_lost_{0};
  std::int64_t refused_{0};
  std::deque<HeardEvent> events_;
  std::deque<Sample> samples_;
  Picture building_, whole_, thumbnail_;
};

}  // namespace cyclops::tools
