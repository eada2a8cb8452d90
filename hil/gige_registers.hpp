#pragma once
/// The register file of the GigE Vision device: bootstrap registers, camera features and the GenICam description.
///
/// Threads  none of its own; the device serialises. Memory: the description is a string made once.
/// Errors   every address, alignment, value and right is checked; the answer is a GvcpStatus.
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hil/gige_config.hpp"
#include "hil/gvcp.hpp"

namespace cyclops::hil {

inline constexpr std::size_t kDiscoveryBytes = 0xf8;

/// Addresses that are used in more than one place. Bootstrap ones are fixed by the standard.
namespace reg {
inline constexpr std::uint32_t kXmlUrl = 0x200, kHeartbeat = 0x938, kTimestampControl = 0x944, kLatchHigh = 0x948,
                               kControl = 0xa00, kStreamPort = 0xd00, kPacketSize = 0xd04, kPacketDelay = 0xd08,
                               kStreamAddress = 0xd18, kStreamSourcePort = 0xd1c;
inline constexpr std::uint32_t kCamera = 0x8000;  ///< our features from here on
inline constexpr std::uint32_t kWidth = 0x8000, kHeight = 0x8004, kPixelFormat = 0x8008, kOffsetX = 0x800c,
                               kOffsetY = 0x8010, kExposure = 0x8014, kFrameRate = 0x8018, kPayload = 0x801c,
                               kAcquisition = 0x8020, kAcquisitionMode = 0x8024, kLineSelector = 0x8028,
                               kLineSource0 = 0x802c, kLineSource1 = 0x8030, kMaxWidth = 0x8034, kMaxHeight = 0x8038;
inline constexpr std::uint32_t kXml = 0x10000;
}  // namespace reg

/// Pixel format number of the standard.
[[nodiscard]] std::uint32_t pfnc(PixelFormat format);

struct WriteContext {
  GvcpPeer peer;
  std::int64_t now_ns{0};
  std::uint64_t tick{0};
};

/// Where the stream goes and how.
struct StreamTarget {
  std::uint32_t address{0};  ///< host order; 0: nowhere
  std::uint16_t port{0};
  int packet_bytes{0};       ///< with IP and UDP headers
};

class GigeRegisters {
 public:
  /// `address`: own IPv4, host order.
  GigeRegisters(const GigeConfig& config, std::uint32_t address);

  [[nodiscard]] GvcpStatus read(std::uint32_t address, std::span<std::uint8_t> out) const;
  [[nodiscard]] GvcpStatus write(std::uint32_t address, std::uint32_t value, const WriteContext& context, GvcpEffects& effects);
  [[nodiscard]] bool may_write(GvcpPeer peer) const { return controller_ && *controller_ == peer; }
  /// Resends are asked for from the socket of the stream, so only the host is compared.
  [[nodiscard]] bool may_resend(GvcpPeer peer) const { return controller_ && controller_->address == peer.address; }
  [[nodiscard]] bool hidden_from(GvcpPeer peer) const;  ///< another application holds exclusive access

  void heard(GvcpPeer peer, std::int64_t now_ns);       ///< a command of the controller is a heartbeat
  /// True when control ended because the controller fell silent; acquisition ends with it.
  bool expire(std::int64_t now_ns);
  void power_on();                                      ///< everything as configured, nobody in control
  void set_source_port(std::uint16_t port);
  void set_float(std::uint32_t address, double value);  ///< by the camera itself, unchecked

  [[nodiscard]] bool acquiring() const { return value(reg::kAcquisition) == 1; }
  [[nodiscard]] bool controlled() const { return controller_.has_value(); }
  [[nodiscard]] StreamTarget target() const;
  [[nodiscard]] std::uint32_t value(std::uint32_t address) const;

 private:
  static constexpr std::size_t kBootstrapBytes = 0x1000, kCameraBytes = 0x40;
  [[nodiscard]] const std::uint8_t* find(std::uint32_t address, std::size_t n) const;
  void put(std::uint32_t address, std::uint32_t value);
  void put_text(std::uint32_t address, const std::string& text, std::size_t room);
  void update_payload();
  void release_control(GvcpEffects* effects);
  GvcpStatus write_control(std::uint32_t value, const WriteContext& context, GvcpEffects& effects);
  GvcpStatus write_stream(std::uint32_t address, std::uint32_t value, GvcpEffects& effects);
  GvcpStatus write_geometry(std::uint32_t address, std::uint32_t value);
  GvcpStatus write_camera(std::uint32_t address, std::uint32_t value, GvcpEffects& effects);
  GvcpStatus write_clock(std::uint32_t address, std::uint32_t value, std::uint64_t tick);

  GigeConfig config_;
  std::uint32_t own_address_;
  std::string xml_;
  std::array<std::uint8_t, kBootstrapBytes> bootstrap_{};
  std::array<std::uint8_t, kCameraBytes> camera_{};
  std::optional<GvcpPeer> controller_;
  std::int64_t heard_ns_{0};
  std::uint16_t source_port_{0};
};

/// Loopback, link-local or private: the only places this device sends to.
[[nodiscard]] bool is_local_address(std::uint32_t address);

}  // namespace cyclops::hil
