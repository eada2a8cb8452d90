#include "nav/navigator.hpp"

namespace cyclops {
namespace {

using Kind = TspiBuffer::Kind;

bool usable(Kind kind) { return kind == Kind::kInterpolated || kind == Kind::kPredicted; }

/// An aircraft without any TSPI is named before one whose TSPI is too old, the receiver before the tanker.
NavAbsence absence(Kind receiver, Kind tanker) {
  if (receiver == Kind::kEmpty && tanker == Kind::kEmpty) return NavAbsence::kNoBoth;
  if (receiver == Kind::kEmpty) return NavAbsence::kNoReceiver;
  if (tanker == Kind::kEmpty) return NavAbsence::kNoTanker;
  if (receiver == Kind::kTooFar) return NavAbsence::kTooOldReceiver;
  if (tanker == Kind::kTooFar) return NavAbsence::kTooOldTanker;
  return NavAbsence::kNone;
}

}  // namespace

Navigator::Navigator(const NavConfig& config, const NavRig& rig) : config_(config), rig_(rig), receiver_(config), tanker_(config) {
  CYCLOPS_ASSERT(config.validated().ok());
}

Admission Navigator::push(const Tspi& sample) {
  return sample.aircraft == Aircraft::kReceiver ? receiver_.push(sample) : tanker_.push(sample);
}

NavAnswer Navigator::at(Time t, Duration t_sigma) const {
  const TspiBuffer::Answer r = receiver_.at(t);
  const TspiBuffer::Answer k = tanker_.at(t);
  NavAnswer out;
  out.absence = absence(r.kind, k.kind);
  if (usable(r.kind) && usable(k.kind)) {
    out.state = relative_state(r.state, k.state, rig_, config_.position_correlation, t_sigma);
    out.state.valid = true;
    out.state.extrapolated = r.kind == Kind::kPredicted || k.kind == Kind::kPredicted;
  }
  out.state.t = t;
  out.state.age_receiver = r.age;
  out.state.age_tanker = k.age;
  return out;
}

}  // namespace cyclops
