#pragma once
/// Bytes of one LCM message to a struct, or the reason why not.
///
/// Errors   where = channel; what = field, value, expected. Codes:
///            kTruncated  the bytes end before the message does
///            kCorrupt    another fingerprint, bytes left over, a length that cannot be
///            kInvalid    a field is not finite, out of range, or does not fit the channel
///            kUnusable   the sender itself says INVALID (only TSPI)
///          The first thing wrong in the order of the fields is named. No input makes a decoder throw, read outside
///          [data, data + size) or allocate more than the text of its error.
/// Views    string_view and span in the result point into `data`.
/// Threads  any.
#include <cstddef>

#include "base/result.hpp"
#include "wire/messages.hpp"

namespace cyclops {

/// What a TSPI message may say; beyond it, it is refused. See docs/icd.md.
namespace tspi_limits {
inline constexpr double kHeightLow_m = -1000;
inline constexpr double kHeightHigh_m = 30000;
inline constexpr double kSpeed_mps = 500;
inline constexpr double kRate_rps = 20;
inline constexpr double kQuaternionNorm = 1e-3;     // from 1; normalised after the check
inline constexpr double kPositionSigma_m = 1000;
inline constexpr double kVelocitySigma_mps = 100;
inline constexpr double kAttitudeSigma_rad = 3.2;
}  // namespace tspi_limits

/// No time lies further from zero than this, so that differences do not overflow. ns, 126 years.
inline constexpr std::int64_t kMaxTime_ns = 4'000'000'000'000'000'000;
inline constexpr std::int64_t kMaxExposure_ns = 10'000'000'000;

[[nodiscard]] Result<TspiReport> decode_tspi(const void* data, std::size_t size, Aircraft expected);
[[nodiscard]] Result<LineEdge> decode_strobe_edge(const void* data, std::size_t size);
struct SourcedMark {
  TimeMark mark{};
  MarkSource source{MarkSource::kPps};
};
[[nodiscard]] Result<SourcedMark> decode_time_mark(const void* data, std::size_t size);
[[nodiscard]] Result<FrameIndex> decode_frame_index(const void* data, std::size_t size);
[[nodiscard]] Result<FrameDataView> decode_frame_data(const void* data, std::size_t size);
[[nodiscard]] Result<> decode_truth(const void* data, std::size_t size, Truth& out);
[[nodiscard]] Result<Acquisition> decode_acquisition(const void* data, std::size_t size);
[[nodiscard]] Result<Mark> decode_mark(const void* data, std::size_t size);
[[nodiscard]] Result<Seal> decode_seal(const void* data, std::size_t size);
[[nodiscard]] Result<Event> decode_event(const void* data, std::size_t size);

}  // namespace cyclops
