// What a client may write, value by value: the other half of GigeRegisters.
#include <bit>
#include <cmath>

#include "hil/gige_registers.hpp"

namespace cyclops::hil {
namespace {

constexpr std::uint32_t kFireTestPacket = 1U << 31, kPacketFlags = 0xe0000000U, kMinPacketBytes = 576;
constexpr float kMaxExposureUs = 1e6F, kMaxFrameRateHz = 1000.0F;

bool format_known(std::uint32_t v) {
  for (PixelFormat f : {PixelFormat::kMono8, PixelFormat::kMono10, PixelFormat::kMono12, PixelFormat::kMono16})
    if (pfnc(f) == v) return true;
  return false;
}
bool in_range(std::uint32_t bits, float low, float high) {
  const float v = std::bit_cast<float>(bits);
  return std::isfinite(v) && v >= low && v <= high;
}

}  // namespace

GvcpStatus GigeRegisters::write(std::uint32_t address, std::uint32_t v, const WriteContext& context, GvcpEffects& effects) {
  if (address % 4 != 0) return GvcpStatus::kBadAlignment;
  if (find(address, 4) == nullptr) return GvcpStatus::kInvalidAddress;
  if (address == reg::kControl) return write_control(v, context, effects);
  if (!may_write(context.peer)) return GvcpStatus::kAccessDenied;
  switch (address) {
    case reg::kHeartbeat:
      if (v < 500 || v > 60'000) return GvcpStatus::kInvalidParameter;
      put(address, v);
      return GvcpStatus::kSuccess;
    case reg::kTimestampControl: return write_clock(address, v, context.tick);
    case reg::kStreamPort: case reg::kPacketSize: case reg::kPacketDelay: case reg::kStreamAddress:
      return write_stream(address, v, effects);
    default: break;
  }
  if (address < reg::kCamera || address >= reg::kXml) return GvcpStatus::kWriteProtect;
  return write_camera(address, v, effects);
}

GvcpStatus GigeRegisters::write_control(std::uint32_t v, const WriteContext& context, GvcpEffects& effects) {
  if (v > 3) return GvcpStatus::kInvalidParameter;
  if (controller_ && *controller_ != context.peer) return GvcpStatus::kAccessDenied;
  if (v == 0) {
    release_control(&effects);
    return GvcpStatus::kSuccess;
  }
  controller_ = context.peer;
  heard_ns_ = context.now_ns;
  put(reg::kControl, v);
  return GvcpStatus::kSuccess;
}

GvcpStatus GigeRegisters::write_clock(std::uint32_t, std::uint32_t v, std::uint64_t tick) {
  if (v != 2) return GvcpStatus::kInvalidParameter;  // latch only: the clock belongs to whoever feeds the frames
  put(reg::kLatchHigh, static_cast<std::uint32_t>(tick >> 32));
  put(reg::kLatchHigh + 4, static_cast<std::uint32_t>(tick));
  return GvcpStatus::kSuccess;
}

GvcpStatus GigeRegisters::write_stream(std::uint32_t address, std::uint32_t v, GvcpEffects& effects) {
  if (address == reg::kStreamAddress && v != 0 && !is_local_address(v)) return GvcpStatus::kInvalidParameter;
  if (address == reg::kStreamPort) {
    if (v > 0xffff) return GvcpStatus::kInvalidParameter;
    if (v == 0 && acquiring()) {  // a closed channel streams no more
      put(reg::kAcquisition, 0);
      effects.acquisition_changed = true;
    }
  }
  if (address == reg::kPacketSize) {
    const std::uint32_t bytes = v & 0xffffU;
    if (bytes < kMinPacketBytes || bytes > static_cast<std::uint32_t>(config_.max_packet_bytes) || bytes % 4 != 0)
      return GvcpStatus::kInvalidParameter;
    if (acquiring() && bytes != (value(address) & 0xffffU)) return GvcpStatus::kBusy;
    effects.fire_test_packet = (v & kFireTestPacket) != 0;
    v = bytes | (v & kPacketFlags & ~kFireTestPacket);
  }
  put(address, v);
  return GvcpStatus::kSuccess;
}

GvcpStatus GigeRegisters::write_geometry(std::uint32_t address, std::uint32_t v) {
  const bool same = v == value(address);
  if (acquiring() && !same) return GvcpStatus::kBusy;
  if (config_.fixed_geometry && !same) return GvcpStatus::kInvalidParameter;
  switch (address) {
    case reg::kWidth: if (v < 1 || v > value(reg::kMaxWidth)) return GvcpStatus::kInvalidParameter; break;
    case reg::kHeight: if (v < 1 || v > value(reg::kMaxHeight)) return GvcpStatus::kInvalidParameter; break;
    case reg::kPixelFormat: if (!format_known(v)) return GvcpStatus::kInvalidParameter; break;
    default: if (v != 0) return GvcpStatus::kInvalidParameter;  // offsets: the frame is the whole sensor
  }
  put(address, v);
  update_payload();
  return GvcpStatus::kSuccess;
}

GvcpStatus GigeRegisters::write_camera(std::uint32_t address, std::uint32_t v, GvcpEffects& effects) {
  bool good = false;
  switch (address) {
    case reg::kWidth: case reg::kHeight: case reg::kPixelFormat: case reg::kOffsetX: case reg::kOffsetY:
      return write_geometry(address, v);
    case reg::kExposure: good = in_range(v, 1.0F, kMaxExposureUs); break;
    case reg::kFrameRate: good = in_range(v, 0.1F, kMaxFrameRateHz); break;
    case reg::kAcquisitionMode: good = v == 0; break;       // continuous
    case reg::kLineSelector: good = v <= 1; break;
    case reg::kLineSource0: case reg::kLineSource1: good = v <= 1; break;  // off, exposure active
    case reg::kAcquisition:
      if (v > 1) return GvcpStatus::kInvalidParameter;
      if (v == 1 && (target().port == 0 || target().address == 0)) return GvcpStatus::kBusy;  // nowhere to send to
      effects.acquisition_changed = v != value(address);
      good = true;
      break;
    default: return GvcpStatus::kWriteProtect;
  }
  if (!good) return GvcpStatus::kInvalidParameter;
  put(address, v);
  return GvcpStatus::kSuccess;
}

}  // namespace cyclops::hil
