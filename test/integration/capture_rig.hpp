#pragma once
/// A camera made of software and the capture stage that receives from it, in one test.
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "capture/camera_source.hpp"
#include "hil/gige_device.hpp"
#include "test/support.hpp"

namespace cyclops::test {

/// Pixels that differ in every place and every frame, within the range of the format.
struct Image {
  Image(int width, int height, PixelFormat format, std::uint64_t seed)
      : bytes(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(bytes_per_pixel(format))),
        view{bytes.data(), width, height, width * bytes_per_pixel(format), format} {
    Random random(seed);
    const auto high = static_cast<std::uint8_t>(0xff >> (16 - bits_per_pixel(format)));
    for (std::size_t i = 0; i < bytes.size(); i += 8) {
      const std::uint64_t r = random();
      std::memcpy(&bytes[i], &r, std::min<std::size_t>(8, bytes.size() - i));
    }
    if (bytes_per_pixel(format) == 2)
      for (std::size_t i = 1; i < bytes.size(); i += 2) bytes[i] &= high;
  }
  std::vector<std::uint8_t> bytes;
  ImageView view;
};

class CaptureRig {
 public:
  /// A small camera; each rig has an address of its own because a closed port may linger in the other side's retries.
  explicit CaptureRig(int width = 320, int height = 240, PixelFormat format = PixelFormat::kMono8) {
    static int last_byte = 10;
    device_config.address = config.address = "127.0.0." + std::to_string(++last_byte);
    device_config.width = 1024;  // what a client finds before it has set anything
    device_config.height = 768;
    config.width_px = width;
    config.height_px = height;
    config.format = format;
    config.watchdog_periods = 3;
    config.frozen_after = 0;     // most tests send one picture again and again
  }
  void start_device() {
    device = std::make_unique<hil::GigeDevice>(device_config);
    const auto started = device->start();
    ASSERT_TRUE(started.ok()) << started.error().message();
  }
  void open() {
    start_device();
    auto opened = CameraSource::open(config);
    ASSERT_TRUE(opened.ok()) << opened.error().message();
    source = std::make_unique<CameraSource>(std::move(opened).value());
    ASSERT_TRUE(std::holds_alternative<CameraStarted>(source->poll(Duration::from_ms(10))));
  }
  /// Sends a frame now. Timestamps are a millisecond a frame apart.
  hil::SendReport send(std::uint64_t block_id, const ImageView& image) {
    return device->send({block_id, static_cast<std::int64_t>(block_id) * 1'000'000 + 7, image}, 0);
  }
  /// The next event of that kind within ten seconds; others on the way are passed over.
  template <class Event>
  std::optional<Event> next() {
    const std::int64_t end = hil::monotonic_ns() + 10'000'000'000;
    while (hil::monotonic_ns() < end) {
      CameraEvent event = source->poll(Duration::from_ms(50));
      if (auto* e = std::get_if<Event>(&event)) return std::optional<Event>(std::move(*e));
    }
    return std::nullopt;
  }
  /// True when the device itself was late: then a loss says nothing about capture.
  [[nodiscard]] bool device_was_late() const { return device->stats().max_late > config.period(); }

  hil::GigeConfig device_config;
  CameraConfig config;
  std::unique_ptr<hil::GigeDevice> device;
  std::unique_ptr<CameraSource> source;
};

inline bool same_rows(const ImageView& got, const Image& sent, int first, int last) {
  const auto row = static_cast<std::size_t>(sent.view.stride_bytes);
  for (int v = first; v <= last; ++v)
    if (std::memcmp(got.row8(v), sent.view.row8(v), row) != 0) return false;
  return true;
}
inline bool same(const ImageView& got, const Image& sent) {
  return got.data != nullptr && got.width == sent.view.width && got.height == sent.view.height && got.format == sent.view.format &&
         same_rows(got, sent, 0, got.height - 1);
}

}  // namespace cyclops::test
