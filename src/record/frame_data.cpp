#include <cstring>

#include <cyclops/frame_data_t.hpp>

#include "record/flight.hpp"

namespace cyclops {
namespace {

/// Reads the big-endian fields of an LCM payload and remembers whether it ran out.
class Cursor {
 public:
  Cursor(const std::uint8_t* data, std::size_t bytes) : at_(data), left_(bytes) {}
  template <class T>
  T number() {
    const std::uint8_t* p = bytes(sizeof(T));
    std::uint64_t v = 0;
    for (std::size_t i = 0; p != nullptr && i < sizeof(T); ++i) v = v << 8 | p[i];
    return static_cast<T>(v);
  }
  const std::uint8_t* bytes(std::size_t n) {
    if (n > left_) {
      good_ = false;
      return nullptr;
    }
    const std::uint8_t* p = at_;
    at_ += n;
    left_ -= n;
    return p;
  }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::size_t left() const { return left_; }

 private:
  const std::uint8_t* at_;
  std::size_t left_;
  bool good_{true};
};

template <class T>
void put(std::vector<std::uint8_t>& out, T value) {
  for (std::size_t i = sizeof(T); i-- > 0;) out.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
}

}  // namespace

Result<> decode_frame_data(const std::uint8_t* data, std::size_t bytes, const std::string& where, FlightFrame& out) {
  Cursor in(data, bytes);
  if (in.number<std::int64_t>() != frame_data_t::getHash() || !in.good())
    return make_error(ErrorCode::kCorrupt, where, "is no frame_data_t: another fingerprint");
  out.camera_frame_id = static_cast<std::uint64_t>(in.number<std::int64_t>());
  out.camera_tick_ns = in.number<std::int64_t>();
  out.exposure = Duration{in.number<std::int64_t>()};
  const auto format = in.number<std::uint8_t>();
  const auto width = in.number<std::int16_t>();
  const auto height = in.number<std::int16_t>();
  const auto status = in.number<std::uint8_t>();
  const auto mask_bytes = in.number<std::int32_t>();
  if (!in.good()) return make_error(ErrorCode::kTruncated, where, "ends inside the header of a frame");
  if (format > 3 || status > 2) return make_error(ErrorCode::kCorrupt, where, "pixel format " + std::to_string(format) + ", status " + std::to_string(status) + ", expected 0..3 and 0..2");
  if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide)
    return make_error(ErrorCode::kCorrupt, where, "frame of " + std::to_string(width) + " x " + std::to_string(height) + " px, expected 1 to 4096 a side");
  if (mask_bytes != 0 && mask_bytes != (height + 7) / 8)
    return make_error(ErrorCode::kCorrupt, where, "row mask of " + std::to_string(mask_bytes) + " bytes, expected 0 or " + std::to_string((height + 7) / 8));
  const std::uint8_t* mask = in.bytes(static_cast<std::size_t>(mask_bytes));
  const auto size = in.number<std::int32_t>();
  out.image.format = static_cast<PixelFormat>(format);
  out.image.width = width;
  out.image.height = height;
  out.image.stride_bytes = width * bytes_per_pixel(out.image.format);
  if (!in.good() || size < 0 || static_cast<std::size_t>(size) != out.image.size_bytes() || in.left() != out.image.size_bytes())
    return make_error(ErrorCode::kCorrupt, where, "frame of " + std::to_string(size) + " bytes, expected " + std::to_string(out.image.size_bytes()));
  out.image.data = in.bytes(static_cast<std::size_t>(size));
  out.status = static_cast<FrameStatus>(status);
  out.missing = {};
  for (int v = 0; mask_bytes != 0 && v < height; ++v)
    if ((mask[v / 8] >> (v % 8) & 1U) != 0) out.missing.set_missing(v);
  return Ok{};
}

void encode_frame_data(const FlightFrame& frame, std::vector<std::uint8_t>& out) {
  out.clear();
  const int rows = frame.image.height;
  const bool masked = frame.missing.count() != 0;
  put(out, frame_data_t::getHash());
  put(out, frame.camera_frame_id);
  put(out, frame.camera_tick_ns);
  put(out, frame.exposure.ns);
  put(out, static_cast<std::uint8_t>(frame.image.format));
  put(out, static_cast<std::int16_t>(frame.image.width));
  put(out, static_cast<std::int16_t>(rows));
  put(out, static_cast<std::uint8_t>(frame.status));
  put(out, masked ? (rows + 7) / 8 : 0);
  for (int byte = 0; masked && byte < (rows + 7) / 8; ++byte) {
    std::uint8_t bits = 0;
    for (int b = 0; b < 8 && byte * 8 + b < rows; ++b)
      if (frame.missing.missing(byte * 8 + b)) bits = static_cast<std::uint8_t>(bits | 1U << b);
    out.push_back(bits);
  }
  const auto row_bytes = static_cast<std::size_t>(frame.image.width * bytes_per_pixel(frame.image.format));
  put(out, static_cast<std::int32_t>(row_bytes * static_cast<std::size_t>(rows)));
  for (int v = 0; v < rows; ++v) out.insert(out.end(), frame.image.row8(v), frame.image.row8(v) + row_bytes);
}

}  // namespace cyclops
