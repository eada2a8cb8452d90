#pragma once
/// The front, and beside it the record of what went into it, in that order: replayed, it gives the same bits.
///
/// A report's arrival is in whole microseconds, as a log keeps it. On a bench whose strobe source has its own clock, arrivals
/// are on that clock too: the time of the newest edge, frame or time mark. Reports that come before any of these wait for it; of
/// more than 256 the oldest go, which no frame can need.
/// Threads  one at a time. Memory: none a call.
#include <algorithm>
#include <optional>

#include "service/front.hpp"
#include "service/recorder.hpp"

namespace cyclops {

class RecordedFront {
 public:
  /// `recorder` may be null. `host_now`: CLOCK_MONOTONIC; not asked on a bench with its own clock.
  RecordedFront(Front front, Recorder* recorder, bool own_clock, std::int64_t (*host_now)())
      : front_(std::move(front)), recorder_(recorder), own_clock_(own_clock), known_(!own_clock), host_now_(host_now) {}

  void restart(Time start) {
    front_.restart(start);
    if (!known_) early_start_ = start;
    else if (recorder_ != nullptr) recorder_->acquisition(now(), {AcquisitionChange::kStarted, start});
  }
  void flush() {
    front_.flush();
    if (known_ && recorder_ != nullptr) recorder_->acquisition(now(), {AcquisitionChange::kSilent, {}});
  }
  void push(const StrobeEdge& edge) {
    see(edge.t);
    front_.push(edge);
    if (recorder_ != nullptr) recorder_->edge(now(), edge, StrobeLine::kStrobe);
  }
  bool push(const PpsEdge& edge) {
    see(edge.edge.t);
    if (recorder_ != nullptr) recorder_->edge(now(), edge.edge, StrobeLine::kPps);
    return front_.push(edge);
  }
  bool push(const TimeMark& mark) {
    see(mark.t);
    if (recorder_ != nullptr) recorder_->mark(now(), mark);
    return front_.push(mark);
  }
  TspiVerdict push(const ArrivedTspi& tspi) {
    if (known_) return use(tspi);
    if (early_.full()) {
      std::move(early_.begin() + 1, early_.end(), early_.begin());
      early_.pop_back();
    }
    early_.push_back(tspi);
    return TspiVerdict::kPass;
  }
  /// False: not taken, and not recorded. `number` is the frame's in the record; -1 without one.
  [[nodiscard]] bool push(const FrameInfo& frame, std::uint64_t token, std::int64_t& number) {
    if (frame.t_arrival.ns != 0) see(frame.t_arrival);
    if (!front_.push(frame, token)) return false;
    number = recorder_ != nullptr ? recorder_->frame(now(), frame) : -1;
    return true;
  }
  [[nodiscard]] bool pop(AlignedFrame& out) { return front_.pop(out); }
  [[nodiscard]] const Front& front() const { return front_; }

 private:
  TspiVerdict use(const ArrivedTspi& tspi) {
    const Time arrival = own_clock_ ? now() : tspi.arrival;
    if (recorder_ != nullptr) recorder_->tspi(tspi, arrival);
    return front_.push(tspi.report, arrival);
  }
  /// A clock of a bench goes on, unless it was set.
  void see(Time t) {
    if (t.ns == 0) return;  // an arrival that is not known
    if (t > seen_ || seen_ - t > Duration::from_seconds(1)) seen_ = t;
    if (known_) return;
    known_ = true;
    if (early_start_ && recorder_ != nullptr) recorder_->acquisition(now(), {AcquisitionChange::kStarted, *early_start_});
    for (const ArrivedTspi& tspi : early_) use(tspi);
    early_.clear();
  }
  [[nodiscard]] Time now() const { return Time{(own_clock_ ? seen_.ns : host_now_()) / 1000 * 1000}; }

  Front front_;
  Recorder* recorder_;
  bool own_clock_;
  bool known_;                          // what time it is
  std::optional<Time> early_start_;
  StaticVector<ArrivedTspi, 256> early_{};
  std::int64_t (*host_now_)();
  Time seen_{};
};

}  // namespace cyclops
