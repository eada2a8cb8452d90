#pragma once
/// Which faults of a script are on now, whom they hit, and how often each has struck.
///
/// The same script hits the same items for the same sequence of questions: chance comes from the seed alone.
/// Threads  advance() by one; the rest by any.
#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/time.hpp"
#include "hil/fault_script.hpp"
#include "msg/tspi.hpp"

namespace cyclops::hil {

class FaultPlayer {
 public:
  explicit FaultPlayer(FaultScript script);
  /// `flight_s`: seconds since the first message; `host_ns`: CLOCK_MONOTONIC. Tells which faults begin and end here.
  void advance(double flight_s, std::int64_t host_ns);
  void on_change(std::function<void(const Fault&, bool on)> callback) { on_change_ = std::move(callback); }
  /// Ends what is still on.
  void finish(std::int64_t host_ns);

  [[nodiscard]] bool has(FaultKind kind) const;
  /// The first fault of the kind that is on; it counts nothing.
  [[nodiscard]] const Fault* on(FaultKind kind) const;
  /// The same if chance, by its share, says that it hits this item; counted.
  [[nodiscard]] const Fault* strike(FaultKind kind);
  /// The same for kinds that concern one aircraft or both.
  [[nodiscard]] const Fault* strike(FaultKind kind, Aircraft aircraft);
  void note(const Fault& fault, std::uint64_t times = 1);
  /// In [0, 1), of this fault's own sequence.
  [[nodiscard]] double chance(const Fault& fault);
  /// Sum of the kind's `amount` over the faults that are on; for steps.
  [[nodiscard]] double sum(FaultKind kind) const;
  /// Sum of `amount` times the seconds the fault has lasted, for ever after: for drifts.
  [[nodiscard]] double integral(FaultKind kind) const;

  /// One object a fault: name, kind, text, onset_s, duration_s, struck, from_ns and until_ns (CLOCK_MONOTONIC; 0: not yet).
  [[nodiscard]] nlohmann::json report() const;

 private:
  struct Live {
    Fault fault;
    std::atomic<bool> on{false};
    std::atomic<std::uint64_t> struck{0}, drawn{0};
    std::int64_t from_ns{0}, until_ns{0};
    bool over{false};
  };
  [[nodiscard]] std::size_t index(const Fault& fault) const;
  void set(Live& live, bool on, std::int64_t host_ns);
  template <class Fits>
  const Fault* strike_if(FaultKind kind, Fits fits);

  [[nodiscard]] const std::vector<Live*>& of(FaultKind kind) const { return by_kind_[static_cast<std::size_t>(kind)]; }

  std::vector<std::unique_ptr<Live>> faults_;
  std::array<std::vector<Live*>, kFaultKinds> by_kind_;
  std::int64_t seed_;
  std::function<void(const Fault&, bool)> on_change_;
  std::atomic<double> now_s_{0};
};

}  // namespace cyclops::hil
