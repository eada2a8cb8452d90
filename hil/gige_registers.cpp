#include "hil/gige_registers.hpp"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <cstring>

#include "base/result.hpp"
#include "hil/gige_xml.hpp"

namespace cyclops::hil {

std::uint32_t pfnc(PixelFormat format) {
  switch (format) {
    case PixelFormat::kMono8: return 0x01080001;
    case PixelFormat::kMono10: return 0x01100003;
    case PixelFormat::kMono12: return 0x01100005;
    case PixelFormat::kMono16: return 0x01100007;
  }
  return 0;
}

bool is_local_address(std::uint32_t a) {
  return (a >> 24) == 127 || (a >> 24) == 10 || (a >> 20) == 0xac1 || (a >> 16) == 0xc0a8 || (a >> 16) == 0xa9fe;
}

GigeRegisters::GigeRegisters(const GigeConfig& config, std::uint32_t address)
    : config_(config), own_address_(address), xml_(gige_xml(config)) {
  xml_.resize((xml_.size() + 3) / 4 * 4, '\n');
  power_on();
}

void GigeRegisters::power_on() {
  bootstrap_.fill(0);
  camera_.fill(0);
  controller_.reset();
  put(0x0, 0x00020000);          // GigE Vision 2.0
  put(0x4, 0x80000001);          // big endian, UTF-8
  put(0x8, 0x0000'02c1);         // locally administered MAC, made of the address
  put(0xc, own_address_);
  put(0x10, 0x6);
  put(0x14, 0x6);
  put(0x24, own_address_);
  put(0x34, 0xff000000);
  put_text(0x48, config_.vendor, 32);
  put_text(0x68, config_.model, 32);
  put_text(0x88, CYCLOPS_VERSION, 32);
  put_text(0xa8, "replayed frames, no sensor", 48);
  put_text(0xd8, config_.serial, 16);
  char url[64];
  std::snprintf(url, sizeof url, "Local:camera.xml;%x;%zx", reg::kXml, xml_.size());
  put_text(reg::kXmlUrl, url, 512);
  put(0x600, 1);                 // network interfaces
  put(0x904, 1);                 // stream channels
  put(0x934, 0x40000007);        // serial number, resend, write memory, concatenation
  put(reg::kHeartbeat, static_cast<std::uint32_t>(config_.heartbeat_ms));
  put(0x93c, static_cast<std::uint32_t>(config_.tick_hz >> 32));
  put(0x940, static_cast<std::uint32_t>(config_.tick_hz));
  put(reg::kPacketSize, static_cast<std::uint32_t>(config_.max_packet_bytes));
  put(reg::kStreamSourcePort, source_port_);
  put(reg::kWidth, static_cast<std::uint32_t>(config_.width));
  put(reg::kHeight, static_cast<std::uint32_t>(config_.height));
  put(reg::kPixelFormat, pfnc(config_.format));
  put(reg::kExposure, std::bit_cast<std::uint32_t>(static_cast<float>(config_.exposure_us)));
  put(reg::kFrameRate, std::bit_cast<std::uint32_t>(static_cast<float>(config_.frame_rate_hz)));
  put(reg::kLineSource1, 1);
  put(reg::kMaxWidth, static_cast<std::uint32_t>(config_.max_width));
  put(reg::kMaxHeight, static_cast<std::uint32_t>(config_.max_height));
  update_payload();
}

const std::uint8_t* GigeRegisters::find(std::uint32_t address, std::size_t n) const {
  const auto inside = [&](std::uint32_t base, std::size_t size) {
    return address >= base && n <= size && address - base <= size - n;
  };
  if (inside(0, kBootstrapBytes)) return &bootstrap_[address];
  if (inside(reg::kCamera, kCameraBytes)) return &camera_[address - reg::kCamera];
  if (inside(reg::kXml, xml_.size())) return reinterpret_cast<const std::uint8_t*>(xml_.data()) + (address - reg::kXml);
  return nullptr;
}

GvcpStatus GigeRegisters::read(std::uint32_t address, std::span<std::uint8_t> out) const {
  if (address % 4 != 0 || out.size() % 4 != 0) return GvcpStatus::kBadAlignment;
  const std::uint8_t* p = find(address, out.size());
  if (p == nullptr) return GvcpStatus::kInvalidAddress;
  std::memcpy(out.data(), p, out.size());
  return GvcpStatus::kSuccess;
}

std::uint32_t GigeRegisters::value(std::uint32_t address) const {
  const std::uint8_t* p = find(address, 4);
  CYCLOPS_ASSERT(p != nullptr);
  return get_be32(p);
}

void GigeRegisters::put(std::uint32_t address, std::uint32_t value) {
  auto* p = const_cast<std::uint8_t*>(find(address, 4));
  CYCLOPS_ASSERT(p != nullptr);
  put_be32(p, value);
}

void GigeRegisters::put_text(std::uint32_t address, const std::string& text, std::size_t room) {
  std::memcpy(&bootstrap_[address], text.data(), std::min(text.size(), room - 1));
}

void GigeRegisters::update_payload() {
  const std::uint32_t bytes = value(reg::kPixelFormat) == pfnc(PixelFormat::kMono8) ? 1 : 2;
  put(reg::kPayload, value(reg::kWidth) * value(reg::kHeight) * bytes);
}

bool GigeRegisters::hidden_from(GvcpPeer peer) const {
  return controller_ && *controller_ != peer && (value(reg::kControl) & 1U) != 0;
}

void GigeRegisters::heard(GvcpPeer peer, std::int64_t now_ns) {
  if (may_write(peer)) heard_ns_ = now_ns;
}

void GigeRegisters::release_control(GvcpEffects* effects) {
  if (effects != nullptr && acquiring()) effects->acquisition_changed = true;
  controller_.reset();
  put(reg::kControl, 0);
  put(reg::kAcquisition, 0);
  put(reg::kStreamPort, 0);
  put(reg::kStreamAddress, 0);
}

bool GigeRegisters::expire(std::int64_t now_ns) {
  if (!controller_ || now_ns - heard_ns_ <= std::int64_t{value(reg::kHeartbeat)} * 1'000'000) return false;
  release_control(nullptr);
  return true;
}

void GigeRegisters::set_float(std::uint32_t address, double value) { put(address, std::bit_cast<std::uint32_t>(static_cast<float>(value))); }

void GigeRegisters::set_source_port(std::uint16_t port) {
  source_port_ = port;
  put(reg::kStreamSourcePort, port);
}

StreamTarget GigeRegisters::target() const {
  return {value(reg::kStreamAddress), static_cast<std::uint16_t>(value(reg::kStreamPort) & 0xffffU),
          static_cast<int>(value(reg::kPacketSize) & 0xffffU)};
}

}  // namespace cyclops::hil
