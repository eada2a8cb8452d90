#pragma once
/// A script of faults: what goes wrong, when and for how long. Format and meaning of every kind: docs/faults.md.
///
///   seed = 1
///   [[fault]]
///   kind = "tspi_loss"
///   onset_s = 3.0
///   duration_s = 2.0
///   share = 0.5
///   aircraft = "tanker"
///
/// Time     seconds of the flight since its first message; a loop or a seek goes on counting.
/// Errors   kInvalid with file:line, key, value and what was expected; unknown kinds and keys are refused.
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace cyclops::hil {

enum class FaultKind : std::uint8_t {
  kPacketLoss, kPacketDelay, kPacketReorder, kPacketDuplicate, kFrameTruncated, kFrameLost, kFrameFrozen, kFrameRate, kExposure, kCameraVanish,
  kStrobeLost, kStrobeDoubled, kStrobeLate, kStrobeHeld, kStrobeStuck, kStrobeSpurious,
  kCameraClockStep, kCameraClockDrift, kGpsStep, kGpsDrift, kPpsLoss,
  kTspiLoss, kTspiDelay, kTspiDisorder, kTspiDuplicate, kTspiBias, kTspiFreeze, kTspiNan, kTspiWrongAircraft,
  kDiskSlow, kDiskFull, kDiskReadOnly, kCpuLoad, kFlood,
};
inline constexpr std::size_t kFaultKinds = 34;

struct Fault {
  FaultKind kind{FaultKind::kPacketLoss};
  std::string name;      ///< of the script; the kind when it has none
  double onset_s{0};
  double duration_s{0};
  double share{1};       ///< of what passes by, how much is hit
  double amount{0};      ///< in the kind's own unit
  int choice{0};         ///< index into the kind's options
  std::string text;      ///< channel, or folder of a disk
  [[nodiscard]] double end_s() const { return onset_s + duration_s; }
};

/// How a kind is written in a script: the one table that reader, documentation and tests go by.
struct FaultForm {
  const char* name;
  const char* amount;      ///< key of `amount`, with its unit; null: the kind has none
  double usual, low, high;
  const char* share;       ///< key of `share`; null: everything is hit
  double usual_share;
  const char* choice;      ///< key of `choice`; null: none
  std::vector<std::string> options;
  const char* text;        ///< key of `text`; null: none
};
[[nodiscard]] const FaultForm& form_of(FaultKind kind);
[[nodiscard]] inline const char* name_of(FaultKind kind) { return form_of(kind).name; }

struct FaultScript {
  std::int64_t seed{1};
  std::vector<Fault> faults;  ///< in order of onset
  static Result<FaultScript> load(const std::string& path);
  static Result<FaultScript> parse(const std::string& text, const std::string& name);
};

}  // namespace cyclops::hil
