#include "monitor/quantity.hpp"

#include <algorithm>
#include <limits>

namespace cyclops {
namespace {

double known(double v) { return v < 0 ? std::numeric_limits<double>::quiet_NaN() : v; }

#define CYCLOPS_ALWAYS(field, unit) {#field, unit, [](const health_t& h) { return static_cast<double>(h.field); }}
#define CYCLOPS_IF_KNOWN(field, unit) {#field, unit, [](const health_t& h) { return known(static_cast<double>(h.field)); }}

constexpr Quantity kQuantities[] = {
    CYCLOPS_ALWAYS(state, ""),
    CYCLOPS_ALWAYS(frame_rate_hz, "Hz"),
    CYCLOPS_IF_KNOWN(frame_rate_share, ""),
    CYCLOPS_ALWAYS(frame_age_ms, "ms"),
    CYCLOPS_ALWAYS(measurement_age_ms, "ms"),
    CYCLOPS_ALWAYS(frames_lost_1s, ""),
    CYCLOPS_IF_KNOWN(time_source, ""),
    CYCLOPS_ALWAYS(time_sigma_us, "us"),
    CYCLOPS_ALWAYS(strobe_rate_hz, "Hz"),
    CYCLOPS_IF_KNOWN(strobe_age_s, "s"),
    CYCLOPS_IF_KNOWN(gps_sigma_us, "us"),
    CYCLOPS_IF_KNOWN(gps_age_s, "s"),
    CYCLOPS_ALWAYS(tspi_receiver_silence_ms, "ms"),
    CYCLOPS_ALWAYS(tspi_tanker_silence_ms, "ms"),
    CYCLOPS_ALWAYS(tspi_receiver_rate_hz, "Hz"),
    CYCLOPS_ALWAYS(tspi_tanker_rate_hz, "Hz"),
    CYCLOPS_ALWAYS(nav_contradicted, ""),
    CYCLOPS_ALWAYS(refused_1s, ""),
    CYCLOPS_IF_KNOWN(range_m, "m"),
    CYCLOPS_ALWAYS(closure_mps, "m/s"),
    CYCLOPS_ALWAYS(features_visible, ""),
    CYCLOPS_ALWAYS(features_matched, ""),
    CYCLOPS_ALWAYS(tracks_live, ""),
    CYCLOPS_IF_KNOWN(consensus_share, ""),
    CYCLOPS_ALWAYS(residual_rms_px, "px"),
    CYCLOPS_ALWAYS(nis_mean, ""),
    CYCLOPS_ALWAYS(integrity, ""),
    CYCLOPS_ALWAYS(chain_us_p50, "us"),
    CYCLOPS_ALWAYS(chain_us_p99, "us"),
    CYCLOPS_ALWAYS(latency_ms_p50, "ms"),
    CYCLOPS_ALWAYS(latency_ms_p99, "ms"),
    CYCLOPS_ALWAYS(latency_ms_max, "ms"),
    CYCLOPS_IF_KNOWN(disk_left_min, "min"),
    CYCLOPS_IF_KNOWN(load, ""),
    CYCLOPS_IF_KNOWN(temperature_c, "C"),
    CYCLOPS_ALWAYS(cpu_percent, "%"),
    CYCLOPS_ALWAYS(memory_mb, "MB"),
    CYCLOPS_ALWAYS(open_files, ""),
};

}  // namespace

std::span<const Quantity> quantities() { return kQuantities; }

const Quantity* find_quantity(std::string_view name) {
  const auto found = std::find_if(std::begin(kQuantities), std::end(kQuantities), [&](const Quantity& q) { return name == q.name; });
  return found == std::end(kQuantities) ? nullptr : found;
}

}  // namespace cyclops
