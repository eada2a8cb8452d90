#include "capture/camera_settings.hpp"

#include <cmath>
#include <cstdlib>
#include <mutex>

namespace cyclops {
namespace arv {

void quiet() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (std::getenv("ARV_DEBUG") == nullptr) arv_debug_enable("all:0");
  });
}

}  // namespace arv
namespace {

std::string shown(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", v);
  return text;
}

/// Writes and reads back features of one camera; the first thing that is not as wanted is the error.
class Settings {
 public:
  Settings(ArvCamera* camera, std::string where) : camera_(camera), where_(std::move(where)) {}

  Result<> integer(const char* name, gint64 wanted) {
    arv_camera_set_integer(camera_, name, wanted, fault_.out());
    const std::string refused = fault_.failed() ? fault_.text() : "";
    return integer_is(name, wanted, refused);
  }
  Result<> integer_is(const char* name, gint64 wanted, const std::string& refused = "") {
    const gint64 is = arv_camera_get_integer(camera_, name, fault_.out());
    if (fault_.failed()) return lacking(name);
    return is == wanted ? Result<>(Ok{}) : differs(name, std::to_string(is), std::to_string(wanted), refused);
  }
  /// `tolerance` is relative: a camera counts in steps of its own.
  Result<> real(const char* name, double wanted, double tolerance) {
    arv_camera_set_float(camera_, name, wanted, fault_.out());
    return real_is(name, wanted, tolerance, fault_.failed() ? fault_.text() : "");
  }
  Result<> real_is(const char* name, double wanted, double tolerance, const std::string& refused = "") {
    const double is = arv_camera_get_float(camera_, name, fault_.out());
    if (fault_.failed()) return lacking(name);
    return std::abs(is - wanted) <= tolerance * wanted ? Result<>(Ok{}) : differs(name, shown(is), shown(wanted), refused);
  }
  Result<> text(const char* name, const std::string& wanted) {
    arv_camera_set_string(camera_, name, wanted.c_str(), fault_.out());
    const std::string refused = fault_.failed() ? fault_.text() : "";
    const char* is = arv_camera_get_string(camera_, name, fault_.out());
    if (fault_.failed() || is == nullptr) return lacking(name);
    return is == wanted ? Result<>(Ok{}) : differs(name, is, wanted, refused);
  }
  [[nodiscard]] bool has(const char* name) { return arv_camera_is_feature_available(camera_, name, nullptr) != FALSE; }

 private:
  [[nodiscard]] Error lacking(const char* name) const {
    return make_error(ErrorCode::kUnsupported, where_ + ": " + name, "cannot be read: " + fault_.text());
  }
  [[nodiscard]] Error differs(const char* name, const std::string& is, const std::string& wanted, const std::string& refused) const {
    return make_error(ErrorCode::kInvalid, where_ + ": " + name,
                      "is " + is + ", expected " + wanted + (refused.empty() ? "" : " (" + refused + ")"));
  }
  ArvCamera* camera_;
  std::string where_;
  arv::Fault fault_;
};

constexpr double kRateTolerance = 1e-3, kExposureTolerance = 1e-2;

const char* exposure_of(Settings& s) { return s.has("ExposureTime") ? "ExposureTime" : "ExposureTimeAbs"; }
const char* rate_of(Settings& s) { return s.has("AcquisitionFrameRate") ? "AcquisitionFrameRate" : "AcquisitionFrameRateAbs"; }

Result<> apply(const CameraConfig& c, ArvCamera* camera, const std::string& where) {
  Settings s(camera, where);
  arv_camera_clear_triggers(camera, nullptr);  // free running; a camera without triggers is free running
  for (const char* automatic : {"ExposureAuto", "GainAuto"})
    if (s.has(automatic)) CYCLOPS_TRY(s.text(automatic, "Off"));
  CYCLOPS_TRY(s.text("PixelFormat", name_of(c.format)));
  for (const char* offset : {"OffsetX", "OffsetY"})
    if (s.has(offset)) CYCLOPS_TRY(s.integer(offset, 0));
  CYCLOPS_TRY(s.integer("Width", c.width_px));
  CYCLOPS_TRY(s.integer("Height", c.height_px));
  CYCLOPS_TRY(s.integer_is("PayloadSize", static_cast<gint64>(c.payload_bytes())));
  if (s.has("AcquisitionMode")) CYCLOPS_TRY(s.text("AcquisitionMode", "Continuous"));
  CYCLOPS_TRY(s.real(exposure_of(s), c.exposure_us, kExposureTolerance));
  if (s.has("AcquisitionFrameRateEnable")) {
    arv::Fault ignored;
    arv_camera_set_boolean(camera, "AcquisitionFrameRateEnable", TRUE, ignored.out());
  }
  CYCLOPS_TRY(s.real(rate_of(s), c.frame_rate_hz, kRateTolerance));
  if (!c.strobe_line.empty()) {
    CYCLOPS_TRY(s.text("LineSelector", c.strobe_line));
    CYCLOPS_TRY(s.text("LineSource", "ExposureActive"));
  }
  return Ok{};
}

Result<int> agree_on_packet_size(const CameraConfig& c, ArvCamera* camera, const std::string& where) {
  arv::Fault fault;
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  if (c.packet_bytes == 0) arv_camera_gv_auto_packet_size(camera, fault.out());
  else arv_camera_gv_set_packet_size(camera, c.packet_bytes, fault.out());
  const std::string refused = fault.failed() ? " (" + fault.text() + ")" : "";
  const auto is = static_cast<int>(arv_camera_gv_get_packet_size(camera, fault.out()));
  if (fault.failed() || is < 100) return make_error(ErrorCode::kIo, where + ": GevSCPSPacketSize", "cannot be read: " + fault.text());
  if (c.packet_bytes != 0 && is != c.packet_bytes)
    return make_error(ErrorCode::kInvalid, where + ": GevSCPSPacketSize",
                      "is " + std::to_string(is) + ", expected " + std::to_string(c.packet_bytes) + refused);
  return is;
}

}  // namespace

Result<> verify_settings(const CameraConfig& config, ArvCamera* camera) {
  auto there = probe_camera(config.address, config.probe_timeout);  // the library would wait for seconds
  if (!there) return there.error();
  Settings s(camera, "camera " + config.address);
  CYCLOPS_TRY(s.real_is(exposure_of(s), config.exposure_us, kExposureTolerance));
  return s.real_is(rate_of(s), config.frame_rate_hz, kRateTolerance);
}

Result<OpenCamera> open_camera(const CameraConfig& config) {
  arv::quiet();
  const std::string where = "camera " + config.address;
  auto found = probe_camera(config.address, config.probe_timeout);
  if (!found) return found.error();
  const arv::Owner<GInetAddress> local(g_inet_address_new_from_string(found->local_address.c_str()));
  const arv::Owner<GInetAddress> remote(g_inet_address_new_from_string(config.address.c_str()));
  arv::Fault fault;
  const arv::Owner<ArvDevice> device(arv_gv_device_new(local.get(), remote.get(), fault.out()));
  if (fault.failed() || !device) return make_error(ErrorCode::kIo, where, "cannot be opened: " + fault.text());
  if (arv_gv_device_is_controller(ARV_GV_DEVICE(device.get())) == FALSE)
    return make_error(ErrorCode::kIo, where, "another program is in control of it");
  arv_device_set_range_check_policy(device.get(), ARV_RANGE_CHECK_POLICY_ENABLE);
  OpenCamera open;
  open.camera.reset(arv_camera_new_with_device(device.get(), fault.out()));
  if (fault.failed() || !open.camera) return make_error(ErrorCode::kIo, where, "is not usable: " + fault.text());
  CYCLOPS_TRY(apply(config, open.camera.get(), where));
  auto packet_bytes = agree_on_packet_size(config, open.camera.get(), where);
  if (!packet_bytes) return packet_bytes.error();
  arv_camera_gv_set_stream_options(open.camera.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  open.packet_bytes = packet_bytes.value();
  open.tick_hz = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device.get()), nullptr);
  open.found = std::move(found).value();
  return open;
}

}  // namespace cyclops
