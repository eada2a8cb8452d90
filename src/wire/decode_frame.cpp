#include <cyclops/frame_data_t.hpp>
#include <cyclops/frame_index_t.hpp>

#include "wire/channels.hpp"
#include "wire/decode.hpp"
#include "wire/reader.hpp"

namespace cyclops {
namespace {

using wire::Reader;

constexpr std::size_t kMaxName = 255;
constexpr std::size_t kMaxThumbnail = std::size_t{1} << 20;

PixelFormat pixel_format(Reader& in) {
  return static_cast<PixelFormat>(in.small<std::int8_t>("pixel_format", frame_index_t::MONO8, frame_index_t::MONO16));
}

FrameStatus frame_status(Reader& in) {
  return static_cast<FrameStatus>(in.small<std::int8_t>("status", frame_index_t::COMPLETE, frame_index_t::MISSING));
}

int side(Reader& in, const char* field) { return static_cast<int>(in.small<std::int16_t>(field, 0, kMaxImageSide)); }

void check_size(Reader& in, FrameStatus status, int width, int height) {
  if (status != FrameStatus::kMissing && (width == 0 || height == 0))
    in.fail(ErrorCode::kInvalid, "width_px, height_px", "are " + std::to_string(width) + ", " + std::to_string(height) + ", expected 1 to 4096 in a frame with pixels");
}

/// Bit v of byte v/8; either empty or one bit for every row.
void read_mask(Reader& in, FrameDataView& out) {
  const std::size_t n = in.length("mask_bytes", kMaxImageSide / 8);
  const auto rows = static_cast<std::size_t>(out.height);
  if (n != 0 && n != (rows + 7) / 8)
    in.fail(ErrorCode::kCorrupt, "mask_bytes", "is " + std::to_string(n) + ", expected 0 or " + std::to_string((rows + 7) / 8));
  const auto mask = in.take("missing_row_mask", n);
  for (std::size_t v = 0; v < mask.size() * 8; ++v) {
    if ((mask[v / 8] >> (v % 8) & 1) == 0) continue;
    if (v >= rows) in.fail(ErrorCode::kCorrupt, "missing_row_mask", "marks row " + std::to_string(v) + " of " + std::to_string(rows));
    else out.missing.set_missing(static_cast<int>(v));
  }
  if (in.ok() && out.status == FrameStatus::kComplete && out.missing.count() != 0)
    in.fail(ErrorCode::kInvalid, "missing_row_mask", "marks rows of a frame that is COMPLETE");
}

void read_pixels(Reader& in, FrameDataView& out) {
  const auto most = static_cast<std::size_t>(kMaxImageSide) * kMaxImageSide * 2;
  const std::size_t n = in.length("size_bytes", most);
  const auto full = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) * static_cast<std::size_t>(bytes_per_pixel(out.format));
  const std::size_t want = out.status == FrameStatus::kMissing ? 0 : full;
  if (n != want) in.fail(ErrorCode::kCorrupt, "size_bytes", "is " + std::to_string(n) + ", expected " + std::to_string(want));
  out.pixels = in.take("pixels", n);
}

}  // namespace

Result<FrameIndex> decode_frame_index(const void* data, std::size_t size) {
  Reader in(channel::kFrame, frame_index_t::getTypeName(), frame_index_t::getHash(), data, size);
  FrameIndex out;
  FrameInfo& info = out.info;
  info.seq = static_cast<std::uint64_t>(in.whole("seq", 0, kMaxTime_ns));
  info.camera_frame_id = static_cast<std::uint64_t>(in.whole("camera_frame_id", 0, kMaxTime_ns));
  info.t_mid = {in.whole("mid_exposure_ns", -kMaxTime_ns, kMaxTime_ns)};
  info.t_mid_sigma = {in.whole("mid_exposure_sigma_ns", 0, kMaxExposure_ns)};
  info.camera_tick_ns = in.whole("camera_tick_ns", -kMaxTime_ns, kMaxTime_ns);
  info.t_arrival = {in.whole("arrival_ns", -kMaxTime_ns, kMaxTime_ns)};
  info.exposure = {in.whole("exposure_ns", 0, kMaxExposure_ns)};
  info.status = frame_status(in);
  info.time_source = static_cast<TimeSource>(in.small<std::int8_t>("time_source", frame_index_t::TIME_STROBE, frame_index_t::TIME_UNKNOWN));
  out.format = pixel_format(in);
  out.width = side(in, "width_px");
  out.height = side(in, "height_px");
  info.missing_rows = static_cast<std::uint32_t>(in.small<std::int16_t>("missing_rows", 0, out.height));
  out.recorded_in = in.text("recorded_in", kMaxName);
  out.recorded_at = in.whole("recorded_at", -1, kMaxTime_ns);
  out.thumbnail_jpeg = in.take("thumbnail_jpeg", in.length("thumbnail_bytes", kMaxThumbnail));
  in.finish();
  if (in.ok()) check_size(in, info.status, out.width, out.height);
  if (!in.ok()) return in.error();
  return out;
}

Result<FrameDataView> decode_frame_data(const void* data, std::size_t size) {
  Reader in(channel::kFrameData, frame_data_t::getTypeName(), frame_data_t::getHash(), data, size);
  FrameDataView out;
  out.camera_frame_id = static_cast<std::uint64_t>(in.whole("camera_frame_id", 0, kMaxTime_ns));
  out.camera_tick_ns = in.whole("camera_tick_ns", -kMaxTime_ns, kMaxTime_ns);
  out.exposure = {in.whole("exposure_ns", 0, kMaxExposure_ns)};
  out.format = pixel_format(in);
  out.width = side(in, "width_px");
  out.height = side(in, "height_px");
  out.status = frame_status(in);
  if (in.ok()) check_size(in, out.status, out.width, out.height);
  if (in.ok()) read_mask(in, out);
  if (in.ok()) read_pixels(in, out);
  in.finish();
  if (!in.ok()) return in.error();
  return out;
}

}  // namespace cyclops
