// What arrivals say about a number on which edges and camera clock agree.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "timesync/frame_stamper.hpp"

namespace cyclops {
namespace {

constexpr int kLateInARow = 4;
constexpr double kLate = 0.7;            // later than usual by this part of a period
constexpr double kEven = 0.3;            // late by the same, to this part of a period
constexpr std::size_t kMostHeld = 32;    // late frames that may wait for proof

}  // namespace

double FrameStamper::transport_of(const Entry& f, Time edge) const {
  return static_cast<double>((f.info.t_arrival - (edge - config_.edge_delay) - f.info.exposure).ns);
}

bool FrameStamper::late(double transport_ns) const { return transport_ns_ && transport_ns > *transport_ns_ + kLate * period_ns_; }

void FrameStamper::note_arrival(const Entry& f, Time edge) {
  if (f.info.t_arrival.ns == 0) return;
  const double transport = transport_of(f, edge);
  if (transport <= static_cast<double>(config_.transport_max.ns))
    transport_ns_ = transport_ns_ ? *transport_ns_ + (transport - *transport_ns_) / 16 : transport;
}

// Two faults can hide each other: the camera leaves out an id just when its clock jumps back by a period, and edges, numbers and ticks
// agree on the exposure before. All frames are then late by a period. So a late frame waits for those behind it: one in time proves
// the number of all before it (the host had stalled), four evenly late prove it wrong. What a frame behind it needs is known when that
// frame comes: nothing here depends on how many are waiting.
FrameStamper::Proof FrameStamper::arrivals_say() const {
  const Entry& front = waiting_.front();
  Pair before = last_frame_;
  int even = 0;
  double first_late_ns = 0;
  for (std::uint64_t i = waiting_.begin_index(); i < waiting_.end_index(); ++i) {
    const Entry& f = waiting_[i];
    if (f.number == 0) continue;
    if (contradiction(f, before)) return Proof::kNever;
    before = {f.number, f.info.camera_tick_ns, {}};
    if (f.info.t_arrival.ns == 0 && i > waiting_.begin_index()) continue;
    const double transport = transport_of(f, line_.at(f.info.camera_tick_ns));
    if (f.info.t_arrival.ns == 0 || !late(transport)) return Proof::kRight;
    even = even > 0 && std::abs(transport - first_late_ns) <= kEven * period_ns_ ? even + 1 : 1;
    if (even == 1) first_late_ns = transport;
    const bool too_long = static_cast<double>((f.info.t_arrival - front.info.t_arrival).ns) > config_.max_wait_frames * period_ns_;
    if (even >= kLateInARow || too_long || i - waiting_.begin_index() + 1 >= kMostHeld) return Proof::kWrong;
  }
  return Proof::kLater;
}

// Late, and nothing will prove the number: the instant lies between what the number says and what the arrival says.
void FrameStamper::without_proof(const Entry& f, const Search& search) {
  const Time edge = search.edge.value_or(line_.at(f.info.camera_tick_ns));
  ++counters_.unproven;
  pass_edges(search, edge);
  waiting_.pop_front();
  last_frame_ = {f.number, f.info.camera_tick_ns, edge};
  emit_arrival(f, Duration{std::llround(std::abs(transport_of(f, edge) - *transport_ns_))});
}

}  // namespace cyclops
