#pragma once
/// A camera, its strobe line and its network as sequences of stamps, with faults, and the truth beside them.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "msg/frame.hpp"
#include "msg/strobe.hpp"
#include "test/support.hpp"
#include "timesync/frame_stamper.hpp"

namespace cyclops::test {

/// What goes wrong, as probabilities per exposure unless said otherwise. The default is a quiet bench.
struct ExposureFaults {
  double lost_edge{0}, doubled_edge{0}, spurious_edge{0}, late_edge{0};
  double lost_frame{0}, incomplete_frame{0};
  double stall{0};                 ///< the host takes no packet for up to ten periods
  double camera_restart{0};        ///< ids and clock start afresh after a pause nobody announces
  double announced_restart{0};     ///< the same, announced by restart()
  double id_slip{0};               ///< an exposure that gets no id
  double id_jump{0};               ///< an id without exposure
  double tick_step{0};             ///< the camera clock jumps
  double pause{0};                 ///< the camera rests for some periods, then ids and clock go on
  int burst{1};                    ///< lost edges and lost frames come in bursts of up to this many
  int first_edges_lost{0};
  int camera_restart_at{0};        ///< exposure before which the camera certainly restarts; 0: none
  int announced_restart_at{0};
  int first_frame{0};              ///< frames before this one are not seen: a start in the middle
};

struct ExposureSetup {
  Duration period{33'333'333};
  Duration exposure{4'000'000};
  Duration transport{6'000'000};        ///< first packet after the end of exposure
  Duration transport_jitter{500'000};   ///< uniform, added
  Duration edge_jitter{20'000};         ///< uniform, both ways
  double rate_ppm{30};                  ///< camera clock against service clock
  bool with_seq{true};
  bool announce_start{true};
  int exposures{100};
  int id_bits{64};
  std::uint64_t first_id{1};
  Time start{5'000'000'000'000};
  ExposureFaults faults{};
};

struct StampInput {
  enum class Kind { kEdge, kFrame, kRestart } kind{Kind::kEdge};
  Time ready{};                  ///< when this input reaches the stamper, if nothing is reordered
  StrobeEdge edge{};
  FrameInfo frame{};
  FrameToken token{0};           ///< index into truth
};

struct ExposureRun {
  std::vector<StampInput> edges, frames;   ///< each in its own order; restarts stand in both, at the same place
  std::vector<Time> truth;                 ///< t_mid by token
  std::vector<int> exposure_of;            ///< exposure number by token
};

struct Stamped { FrameInfo info{}; FrameToken token{0}; };

class Simulation {
 public:
  Simulation(const ExposureSetup& setup, Random& random) : s_(setup), random_(random), t_(setup.start), id_(setup.first_id), tick_zero_(setup.start - Duration{1'000'000'000}) {}

  ExposureRun run() {
    if (s_.announce_start) restart();
    for (i_ = 0; i_ < s_.exposures; ++i_) {
      events();
      expose();
      t_ = t_ + s_.period;
    }
    std::stable_sort(out_.edges.begin(), out_.edges.end(), [](const auto& a, const auto& b) { return a.ready < b.ready; });
    number_edges();
    return std::move(out_);
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Duration uniform(Duration d) { return Duration{static_cast<std::int64_t>(uniform() * static_cast<double>(d.ns))}; }
  bool happens(double p) { return p > 0 && uniform() < p; }
  int burst() { return 1 + static_cast<int>(uniform() * s_.faults.burst); }

  void restart() {
    const Time before = t_ - s_.period;
    StampInput r{StampInput::Kind::kRestart, before, {before, -1, true}, {}, 0};
    out_.edges.push_back(r);
    out_.frames.push_back(r);
  }
  void pause() {
    t_ = t_ + s_.period * 3 + uniform(s_.period * 10);   // the line is quiet
    if (!out_.frames.empty()) t_ = std::max(t_, out_.frames.back().ready + s_.period * 6);
    id_ = s_.first_id;
    tick_zero_ = t_ - Duration{1'000'000} - uniform(Duration{2'000'000'000});
    tick_step_ = {};
  }
  void events() {
    const ExposureFaults& f = s_.faults;
    if (happens(f.camera_restart) || (i_ > 0 && i_ == f.camera_restart_at)) pause();
    if (happens(f.announced_restart) || (i_ > 0 && i_ == f.announced_restart_at)) { pause(); restart(); }
    if (happens(f.pause)) t_ = t_ + s_.period + uniform(s_.period * 6);
    if (happens(f.id_slip)) strobe_only();
    if (happens(f.id_jump)) ++id_;
    if (happens(f.tick_step)) tick_step_ = tick_step_ + uniform(s_.period * 6) - s_.period * 2;
    if (happens(f.stall)) stall_end_ = t_ + uniform(s_.period * 10);
    if (happens(f.lost_edge)) edges_to_lose_ = burst();
    if (happens(f.lost_frame)) frames_to_lose_ = burst();
  }
  void strobe_only() { edge(t_, false); t_ = t_ + s_.period; }

  void edge(Time at, bool lost) {
    ++line_edges_;
    if (lost) { lost_at_.push_back(at); return; }
    out_.edges.push_back({StampInput::Kind::kEdge, at, {at, 0, true}, {}, 0});
  }
  void strobe() {
    Time at = t_ + uniform(s_.edge_jitter * 2) - s_.edge_jitter;
    if (happens(s_.faults.late_edge)) at = at + uniform(Duration{6'000'000});
    const bool lost = edges_to_lose_ > 0 || i_ < s_.faults.first_edges_lost + s_.faults.first_frame;
    if (edges_to_lose_ > 0) --edges_to_lose_;
    edge(at, lost);
    if (happens(s_.faults.doubled_edge)) edge(at + Duration{20'000} + uniform(Duration{2'500'000}), false);
    if (happens(s_.faults.spurious_edge)) edge(t_ + uniform(s_.period), false);
  }
  std::uint64_t shown_id() const { return s_.id_bits == 16 ? (id_ - 1) % 65535 + 1 : id_; }

  void expose() {
    strobe();
    const std::int64_t since = (t_ - tick_zero_).ns;
    FrameInfo f;
    f.camera_frame_id = shown_id();
    ++id_;
    f.camera_tick_ns = since + std::llround(static_cast<double>(since) * s_.rate_ppm * 1e-6) + tick_step_.ns + 3'000'000'000;
    f.exposure = s_.exposure;
    f.status = FrameStatus::kComplete;
    f.t_arrival = std::max(t_ + s_.exposure + s_.transport + uniform(s_.transport_jitter), stall_end_);
    if (!out_.frames.empty()) f.t_arrival = std::max(f.t_arrival, out_.frames.back().ready + Duration{100'000});
    const bool incomplete = happens(s_.faults.incomplete_frame);
    if (incomplete) damage(f);
    if (frames_to_lose_ > 0) { --frames_to_lose_; return; }
    if (i_ < s_.faults.first_frame) return;
    f.seq = out_.truth.size();
    out_.frames.push_back({StampInput::Kind::kFrame, f.t_arrival, {}, f, out_.truth.size()});
    out_.truth.push_back(t_ + s_.exposure / 2);
    out_.exposure_of.push_back(i_);
  }
  // Rows missing; or the leader, and then id and tick are absent or what an earlier frame left in the buffer.
  void damage(FrameInfo& f) {
    const double kind = uniform();
    f.status = kind < 0.5 ? FrameStatus::kPartial : FrameStatus::kMissing;
    if (kind < 0.5) return;
    if (kind < 0.75 || out_.frames.empty()) { f.camera_frame_id = 0; f.camera_tick_ns = 0; return; }
    const FrameInfo& old = out_.frames[out_.frames.size() / 2].frame;
    f.camera_frame_id = old.camera_frame_id;
    f.camera_tick_ns = old.camera_tick_ns;
  }
  // line_seq as the kernel counts: every edge on the line, also those that were lost on the way to the reader.
  void number_edges() {
    std::size_t lost = 0;
    std::int64_t seq = 0;
    for (StampInput& e : out_.edges) {
      if (e.kind != StampInput::Kind::kEdge) continue;
      while (lost < lost_at_.size() && lost_at_[lost] < e.edge.t) { ++lost; ++seq; }
      ++seq;
      e.edge.line_seq = s_.with_seq ? seq : -1;
    }
  }

  const ExposureSetup& s_;
  Random& random_;
  ExposureRun out_;
  int i_{0};
  Time t_;
  std::uint64_t id_;
  Time tick_zero_;
  Duration tick_step_{};
  Time stall_end_{0};
  int edges_to_lose_{0}, frames_to_lose_{0};
  std::int64_t line_edges_{0};
  std::vector<Time> lost_at_;
};

inline ExposureRun simulate(const ExposureSetup& setup, Random& random) { return Simulation(setup, random).run(); }

/// Edges and frames merged by the time they are ready, each delayed by up to the given time, own order kept.
inline std::vector<StampInput> interleave(const ExposureRun& run, Duration edge_delay, Duration frame_delay, Random& random) {
  std::vector<StampInput> out;
  const auto delayed = [&](const StampInput& in, Duration most) {
    return in.kind == StampInput::Kind::kRestart ? in.ready : in.ready + Duration{static_cast<std::int64_t>(std::uniform_real_distribution<double>(0, 1)(random) * static_cast<double>(most.ns))};
  };
  const auto add = [&](const std::vector<StampInput>& list, Duration most, bool restarts) {
    Time last{INT64_MIN};
    for (const StampInput& in : list) {
      if (in.kind == StampInput::Kind::kRestart && !restarts) continue;
      last = std::max(last, delayed(in, most));
      out.push_back(in);
      out.back().ready = last;
    }
  };
  add(run.edges, edge_delay, true);
  add(run.frames, frame_delay, false);
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.ready < b.ready; });
  return out;
}

inline std::vector<Stamped> feed(FrameStamper& stamper, const std::vector<StampInput>& inputs) {
  std::vector<Stamped> out;
  out.reserve(inputs.size());
  const auto drain = [&] {
    for (Stamped s; stamper.pop(s.info, s.token);) out.push_back(s);
  };
  for (const StampInput& in : inputs) {
    if (in.kind == StampInput::Kind::kEdge) stamper.on_edge(in.edge);
    else if (in.kind == StampInput::Kind::kRestart) stamper.restart(in.edge.t);
    else if (!stamper.on_frame(in.frame, in.token)) break;
    drain();
  }
  stamper.flush();
  drain();
  return out;
}

inline FrameStamperConfig stamper_config(const ExposureSetup& setup) {
  FrameStamperConfig c;
  c.period = setup.period;
  c.id_bits = setup.id_bits;
  c.first_frame_id = setup.first_id;
  return c;
}

}  // namespace cyclops::test
