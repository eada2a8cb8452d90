#include "tools/board.hpp"

#include <algorithm>
#include <exception>

#include "wire/channels.hpp"

namespace cyclops::tools {
namespace {

template <class Message>
bool decoded(const void* data, std::size_t size, Message& out) {
  try {
    if (out.decode(data, 0, static_cast<int>(size)) == static_cast<int>(size)) return true;
  } catch (const std::exception&) {
  }
  out = Message();  // gives back what a lie about a length has taken
  return false;
}

}  // namespace

bool Board::take(std::string_view name, const void* data, std::size_t size, std::int64_t now_ns) {
  if (t_first_ns_ == 0) t_first_ns_ = now_ns;
  bool good = true;
  if (name == channel::kHealth) {
    good = decoded(data, size, scratch_);
    if (good) on_health(now_ns);
  } else if (name == channel::kClock) {
    clock_state_t heard{};
    good = decoded(data, size, heard);
    if (good) clock_ = heard;
  } else if (name == channel::kEvent) {
    HeardEvent heard{now_ns, {}};
    good = decoded(data, size, heard.event);
    if (good) events_.push_back(std::move(heard));
    if (events_.size() > kEvents) events_.pop_front();
  } else if (name == channel::kFrame) {
    good = decoded(data, size, building_.frame);
    if (good) building_.seq = building_.frame.seq;
  } else if (name == channel::kPrediction) {
    good = decoded(data, size, building_.prediction);
  } else if (name == channel::kTrack) {
    good = decoded(data, size, building_.track);
  } else if (name == channel::kMeasurement) {
    good = decoded(data, size, building_.measurement);
    if (good) on_measurement();
  } else {
    return false;
  }
  if (!good) ++refused_;
  return good;
}

void Board::on_health(std::int64_t now_ns) {
  const health_t& h = scratch_;
  if (health_ && h.number > health_->number) health_lost_ += h.number - health_->number - 1;
  t_health_ns_ = now_ns;
  samples_.push_back({now_ns, h.range_m, h.closure_mps, h.frame_rate_hz, h.latency_ms_p99, h.residual_rms_px, h.time_sigma_us, h.tspi_receiver_silence_ms,
                      h.tspi_tanker_silence_ms, h.features_matched, h.features_visible, h.frames_lost, h.n_alarms});
  if (samples_.size() > kSamples) samples_.pop_front();
  health_ = h;
}

/// MEASUREMENT is the last message of a frame; a datagram that was lost on the way makes the frame unusable here.
void Board::on_measurement() {
  Picture& b = building_;
  const std::int64_t seq = b.measurement.seq;
  if (b.seq != seq || b.prediction.seq != seq || b.track.seq != seq) return;
  whole_ = b;
  if (b.frame.thumbnail_bytes > 0) thumbnail_ = b;
}

double Board::health_age_s(std::int64_t now_ns) const {
  const std::int64_t then = health_ ? t_health_ns_ : t_first_ns_ == 0 ? now_ns : t_first_ns_;
  return static_cast<double>(now_ns - then) * 1e-9;
}

const alarm_t* Board::alarm_on(std::string_view quantity) const {
  if (!health_) return nullptr;
  const auto found = std::find_if(health_->alarms.begin(), health_->alarms.end(), [&](const alarm_t& a) { return a.quantity == quantity; });
  return found == health_->alarms.end() ? nullptr : &*found;
}

std::int64_t Board::counter(std::string_view name) const {
  if (!health_) return 0;
  for (const counter_t& c : health_->counters)
    if (c.name == name) return c.value;
  return 0;
}

}  // namespace cyclops::tools
