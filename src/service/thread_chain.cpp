// The chain's thread: one queue in, whole frames out.
#include <algorithm>

#include "service/pipeline_state.hpp"
#include "service/recorded_front.hpp"

namespace cyclops {
namespace {

constexpr std::size_t kArrivals = 64;

/// All state of the thread. The order of handle() calls alone decides what comes out.
class ChainThread {
 public:
  explicit ChainThread(Pipeline::State& s)
      : s_(s), front_(Front(s.rig.stamper, s.rig.gps, s.profile.nav, s.rig.nav, s.rig.pps_marks), s.recorder.get(), s.strobe_clock, host_now_ns), chain_(s.rig, s.profile) {
    thumbnail_every_ns_ = s.options.thumbnail_hz > 0 ? static_cast<std::int64_t>(1e9 / s.options.thumbnail_hz) : 0;
  }

  void run() {
    for (;;) {
      auto input = s_.inputs.pop(Duration::from_seconds(1));
      if (!input && s_.inputs.finished()) break;  // a queue that is only silent ends nothing
      if (!input) continue;
      std::visit([this](auto&& item) { handle(std::move(item)); }, std::move(*input));
      drain();
      publish_counts();
    }
    give_up_arrivals(0);
    front_.flush();
    drain();
    publish_counts();
  }

 private:
  void handle(Idle&&) {
    give_up_arrivals(0);
    front_.flush();
  }
  void handle(AcquisitionStarted&& start) {
    give_up_arrivals(0);
    arrivals_.clear();
    // On a recorded clock the host cannot say when that was: after the edges that have come so far.
    front_.restart(s_.strobe_clock && newest_edge_.ns != INT64_MIN ? newest_edge_ + Duration{1} : start.t);
  }
  void handle(StrobeEdge&& edge) {
    newest_edge_ = std::max(newest_edge_, edge.t);
    front_.push(edge);
  }
  void handle(FrameArrival&& arrival) {
    if (arrivals_.full()) drop_oldest_arrival();
    arrivals_.push_back(arrival);
    release_known();
  }
  void handle(TimeMark&& mark) {
    if (front_.push(mark)) say_gps_locked(mark.t);
  }
  void handle(PpsEdge&& edge) {
    if (front_.push(edge)) say_gps_locked(edge.edge.t);
  }
  void say_gps_locked(Time t) {
    const GpsClock& gps = front_.front().gps();
    const bool leap = gps.counters().whole_second_steps != counts_.gps.whole_second_steps;
    s_.events.post(t, leap ? EventLevel::kWarning : EventLevel::kInfo, "time", "gps.locked", "offset " + std::to_string(gps.offset().ns) + " ns" +
                   (leap ? ", a step by whole seconds: leap second, UTC for GPS time, or week rollover?" : ""));
  }
  void handle(ArrivedTspi&& tspi) {
    const TspiVerdict verdict = front_.push(tspi);
    const auto a = static_cast<std::size_t>(tspi.report.aircraft);
    if (verdict == TspiVerdict::kPass) {
      counts_.tspi_arrival[a] = tspi.arrival;
      return;
    }
    const std::uint64_t count = ++guarded_[a];
    if ((count & (count - 1)) == 0)  // 1, 2, 4, 8 ...
      s_.events.post(tspi.arrival, EventLevel::kWarning, a == 0 ? "tspi.receiver" : "tspi.tanker", to_string(verdict), "TSPI refused by the guard", static_cast<std::int64_t>(count));
  }
  void handle(TimedFrame&& frame) {
    if (!s_.strobe_clock) return admit(std::move(frame));
    if (held_.full()) give_up_arrivals(held_.capacity() - 1);
    held_.push_back(room_place(std::move(frame)));
    release_known();
  }

  /// Frames leave in order, each when its arrival on the strobe's clock is known.
  void release_known() {
    while (!held_.empty()) {
      if (held_.front() == WaitingRoom::kPlaces) {
        pop_held();
        continue;
      }
      const FrameInfo& info = held_info_[held_.front()];
      const FrameArrival* found = nullptr;
      for (const FrameArrival& a : arrivals_)
        if (a.camera_frame_id == info.camera_frame_id) found = &a;
      if (found == nullptr && info.camera_frame_id != 0) return;  // a frame without a number has no arrival to wait for
      admit_held(found != nullptr ? found->t : Time{});
    }
  }
  /// An arrival on this host's own clock would be a time of another clock: better none.
  void admit_held(Time arrival) {
    TimedFrame frame = room_.take(held_.front());
    frame.frame.info.t_arrival = arrival;
    pop_held();
    admit(std::move(frame));
  }
  void give_up_arrivals(std::size_t keep) {
    while (held_.size() > keep) {
      if (held_.front() == WaitingRoom::kPlaces) {
        pop_held();
        continue;
      }
      ++counts_.arrival_unknown;
      admit_held({});
    }
  }
  std::size_t room_place(TimedFrame&& frame) {
    const FrameInfo info = frame.frame.info;
    const std::size_t place = make_place(std::move(frame));
    if (place == WaitingRoom::kPlaces) ++counts_.front_refused;
    else held_info_[place] = info;
    return place;
  }
  void pop_held() {
    for (std::size_t i = 1; i < held_.size(); ++i) held_[i - 1] = held_[i];
    held_.pop_back();
  }
  void drop_oldest_arrival() {
    for (std::size_t i = 1; i < arrivals_.size(); ++i) arrivals_[i - 1] = arrivals_[i];
    arrivals_.pop_back();
  }

  /// A frame is let go by a later one; where there is no room for a later one, none would ever be.
  std::size_t make_place(TimedFrame&& frame) {
    const std::size_t place = room_.put(std::move(frame));
    if (place != WaitingRoom::kPlaces) return place;
    ++counts_.room_flushed;
    front_.flush();
    drain();
    return room_.put(std::move(frame));
  }

  void admit(TimedFrame&& frame) {
    const FrameInfo info = frame.frame.info;
    const std::size_t place = make_place(std::move(frame));
    if (place == WaitingRoom::kPlaces) {
      ++counts_.front_refused;
      return;
    }
    if (front_.push(info, place, number_[place])) return drain();
    (void)room_.take(place);
    ++counts_.front_refused;
  }

  void drain() {
    AlignedFrame ready;
    while (front_.pop(ready)) step(ready);
  }

  void step(const AlignedFrame& ready) {
    const auto place = static_cast<std::size_t>(ready.token);
    TimedFrame pixels = room_.take(place);
    std::unique_ptr<Finished> slot;
    while (!slot) {
      auto spare = s_.spare.pop(Duration::from_seconds(1));
      if (spare) slot = std::move(*spare);
    }
    AlignedFrame frame = ready;
    frame.frame.seq = ++counts_.frames;
    const bool partial = frame.frame.status == FrameStatus::kPartial;
    chain_.step(frame, pixels.frame.image, partial ? &pixels.frame.missing : nullptr, slot->out);
    slot->t_mid_gps = front_.front().gps_time(frame.frame.t_mid);
    slot->complete_ns = pixels.complete_ns;
    slot->pixels.reset();
    slot->number = number_[place];
    slot->thumbnail = thumbnail_every_ns_ > 0 && frame.frame.status == FrameStatus::kComplete && (next_thumbnail_.ns == 0 || frame.frame.t_mid >= next_thumbnail_);
    if (slot->thumbnail) next_thumbnail_ = frame.frame.t_mid + Duration{thumbnail_every_ns_};
    if (slot->thumbnail || s_.recorder) slot->pixels.emplace(std::move(pixels.frame));
    count(slot->out);
    s_.frames = counts_.frames;
    CYCLOPS_ASSERT(s_.ready.try_push(std::move(slot)));  // as many places as slots
  }

  void count(const FrameOutput& out) {
    counts_.nav_updates += out.in.scheduled && out.in.nav.state.valid ? 1 : 0;
    counts_.consensus += out.alignment.consensus ? 1 : 0;
    for (const Measurement& m : out.measurements.items) counts_.measurements += m.accepted ? 1 : 0;
  }

  void publish_counts() {
    const Front& front = front_.front();
    counts_.stamp = front.stamper().counters();
    counts_.aligner = front.aligner().counters();
    for (int a = 0; a < 2; ++a) {
      const TspiBuffer& buffer = front.aligner().navigator().buffer(static_cast<Aircraft>(a));
      counts_.tspi[a] = buffer.counters();
      counts_.has_tspi[a] = buffer.size() > 0;
      if (counts_.has_tspi[a]) counts_.newest_tspi[a] = buffer.newest().t;
    }
    counts_.gps = front.gps().counters();
    counts_.pps = front.pps();
    counts_.clocks = front.clocks();
    counts_.front = front.counters();
    counts_.track = chain_.track_counters();
    counts_.associate = chain_.associate_counters();
    const std::lock_guard lock(s_.counts_mutex);
    s_.chain_counts = counts_;
    for (int a = 0; a < 2; ++a) s_.link_counts[a].guarded = guarded_[a];
  }

  Pipeline::State& s_;
  RecordedFront front_;
  Chain chain_;
  WaitingRoom room_;
  StaticVector<std::size_t, 8> held_{};
  std::array<FrameInfo, WaitingRoom::kPlaces> held_info_{};
  std::array<std::int64_t, WaitingRoom::kPlaces> number_{};   // in the record, by place
  StaticVector<FrameArrival, kArrivals> arrivals_{};
  Time newest_edge_{INT64_MIN};
  ChainCounts counts_{};
  std::uint64_t guarded_[2]{};
  Time next_thumbnail_{};
  std::int64_t thumbnail_every_ns_{0};
};

}  // namespace

void Pipeline::State::run_chain() { std::make_unique<ChainThread>(*this)->run(); }

}  // namespace cyclops
