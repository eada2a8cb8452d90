// The publishing thread: results, events, thumbnails and HEALTH to the network.
#include <algorithm>
#include <cmath>
#include <span>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "service/health.hpp"
#include "service/pipeline_state.hpp"

namespace cyclops {
namespace {

const char* told(NavFault fault) {
  switch (fault) {
    case NavFault::kPositionStep: return "TSPI stepped in position, the tanker seen did not; measurements go on from the picture";
    case NavFault::kAttitudeStep: return "TSPI stepped in attitude, the tanker seen did not; measurements go on from the picture";
    case NavFault::kMotion: return "TSPI does not move as its own velocity says; measurements go on from the picture";
    default: return "TSPI disagrees with where the tanker is seen; measurements go on from the picture";
  }
}

constexpr Duration kHealthEvery = Duration::from_ms(200);
constexpr Duration kLookEvery = Duration::from_ms(20);   ///< so soon after its cause an alarm is out
constexpr Duration kSpan = Duration::from_seconds(1);    ///< of the recent percentiles

/// A small JPEG of any pixel format, stretched so that 0.5 % of it is black and 0.5 % white.
void thumbnail(const ImageView& image, int side, std::vector<std::uint8_t>& jpeg) {
  const cv::Mat raw(image.height, image.width, image.format == PixelFormat::kMono8 ? CV_8UC1 : CV_16UC1, const_cast<std::uint8_t*>(image.data), static_cast<std::size_t>(image.stride_bytes));
  const double scale = std::min(1.0, static_cast<double>(side) / std::max(image.width, image.height));
  cv::Mat small, grey;
  cv::resize(raw, small, {}, scale, scale, cv::INTER_AREA);
  cv::Mat values;
  small.reshape(1, 1).convertTo(values, CV_32F);
  const std::span<float> all(values.ptr<float>(), values.total());
  const auto quantile = [&](double q) {
    const auto at = all.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(all.size() - 1));
    std::nth_element(all.begin(), at, all.end());
    return static_cast<double>(*at);
  };
  const double low = quantile(0.005), gain = 255 / std::max(1.0, quantile(0.995) - low);
  small.convertTo(grey, CV_8U, gain, -low * gain);
  cv::imencode(".jpg", grey, jpeg, {cv::IMWRITE_JPEG_QUALITY, 70});
}

FrameFacts facts_of(const FrameOutput& out) {
  FrameFacts f;
  f.t_mid = out.in.frame.t_mid;
  f.t_mid_sigma = out.in.frame.t_mid_sigma;
  f.time_source = out.in.frame.time_source;
  for (const Prediction& p : out.predictions.items) f.visible += p.visibility == Visibility::kVisible ? 1 : 0;
  double squares = 0, nis = 0;
  for (const Measurement& m : out.measurements.items) {
    if (!m.accepted) continue;
    ++f.matched;
    squares += m.innovation_px.squaredNorm();
    nis += m.nis;
  }
  for (const Track& t : out.tracks) {
    f.live += t.state == TrackState::kLive ? 1 : 0;
    f.coasting += t.state == TrackState::kCoasting ? 1 : 0;
  }
  f.residual_rms_px = f.matched > 0 ? std::sqrt(squares / f.matched) : 0;
  f.nis_mean = f.matched > 0 ? nis / f.matched : 0;
  f.integrity = out.measurements.integrity;
  f.nav_suspect = out.nav_suspect;
  const RelativeState& nav = out.in.nav.state;
  if (nav.valid) {
    const Vec3 d = nav.T_r_k.translation().xyz;
    f.range_m = d.norm();
    f.closure_mps = f.range_m > 0 ? -d.dot(nav.velocity_r) / f.range_m : 0;
  }
  return f;
}

/// The network, and the record of what was said on it.
class NetworkSink : public MessageSink {
 public:
  NetworkSink(lcm_t* lcm, Recorder* recorder) : lcm_(lcm), recorder_(recorder) {}
  bool put(Time t, const char* channel, const void* data, std::size_t bytes) override {
    const bool sent = lcm_.put(t, channel, data, bytes);
    if (recorder_ != nullptr) recorder_->published(channel, data, bytes);
    return sent;
  }

 private:
  LcmSink lcm_;
  Recorder* recorder_;
};

class PublishThread {
 public:
  explicit PublishThread(Pipeline::State& s) : s_(s), sink_(s.lcm, s.recorder.get()), publisher_(s.rig, sink_), health_(s) { jpeg_.reserve(1 << 16); }

  void run() {
    for (;;) {
      auto finished = s_.ready.pop(kLookEvery);
      if (finished) publish(std::move(*finished));
      look(host_now_ns(), false);
      events();
      if (!finished && s_.ready.finished()) break;
    }
    look(host_now_ns(), true);
    events();
    s_.publish_failed = publisher_.failed();
  }

 private:
  void publish(std::unique_ptr<Finished> f) {
    jpeg_.clear();
    if (f->thumbnail) thumbnail(f->pixels->image, s_.options.thumbnail_px, jpeg_);
    const bool kept = s_.recorder && s_.recorder->has_room();
    publisher_.frame(f->out, f->t_mid_gps, jpeg_, kept ? RecordedAt{"frames.lcm", f->number} : RecordedAt{});
    s_.last_published_ns = host_now_ns();
    const Duration latency{s_.last_published_ns - f->complete_ns};
    s_.latency.add(latency);
    s_.latency_recent.add(latency);
    for (std::size_t i = 0; i < kStages; ++i) s_.stage[i].add(f->out.stage_time[i]);
    s_.chain_time.add(f->out.chain_time);
    s_.chain_recent.add(f->out.chain_time);
    if (f->out.nav_suspect != s_.facts.nav_suspect) {
      const Time t = f->out.in.frame.t_mid;
      if (f->out.nav_suspect)
        s_.events.post(t, EventLevel::kWarning, "align", "nav.contradicted", told(f->out.nav_fault));
      else s_.events.post(t, EventLevel::kRecovery, "align", "nav.agrees", "TSPI and picture agree again");
    }
    if (s_.recorder && f->pixels) s_.recorder->pixels(std::move(*f->pixels), f->number, f->out.in.frame.t_mid);
    f->pixels.reset();
    s_.facts = facts_of(f->out);
    CYCLOPS_ASSERT(s_.spare.try_push(std::move(f)));
  }

  void events() {
    while (auto e = s_.events.next()) {
      Event event;
      event.t = e->t;
      event.level = e->level;
      event.source = e->source.data();
      event.code = e->code.data();
      event.text = e->text.data();
      event.count = e->count;
      fill(event_, event);
      publisher_.put(e->t, channel::kEvent, event_);
    }
  }

  /// HEALTH five times a second, and at once when an alarm comes or goes.
  void look(std::int64_t now, bool last) {
    if (now < next_look_ns_ && !last) return;
    next_look_ns_ = now + kLookEvery.ns;
    if (!health_.look(now) && now < next_health_ns_ && !last) return;
    publisher_.put(Time{now}, channel::kHealth, health_.message());
    publisher_.put(Time{now}, channel::kClock, health_.clock());
    if (now >= next_health_ns_) next_health_ns_ = std::max(next_health_ns_ + kHealthEvery.ns, now);
    if (now - span_ns_ < kSpan.ns) return;
    s_.latency_recent.turn();
    s_.chain_recent.turn();
    span_ns_ = now;
  }

  Pipeline::State& s_;
  NetworkSink sink_;
  Publisher publisher_;
  std::vector<std::uint8_t> jpeg_;
  event_t event_{};
  HealthMaker health_;
  std::int64_t next_look_ns_{0};
  std::int64_t next_health_ns_{host_now_ns()};
  std::int64_t span_ns_{host_now_ns()};
};

}  // namespace

void Pipeline::State::run_publish() { std::make_unique<PublishThread>(*this)->run(); }

}  // namespace cyclops
