#include <gtest/gtest.h>

#include <cyclops/frame_data_t.hpp>

#include "test/wire/examples.hpp"
#include "wire/decode.hpp"

namespace cyclops {
namespace {

using test::bytes_of;
using test::expect_error;
using Bytes = std::vector<std::uint8_t>;

TEST(DecodeFrameIndex, GivesBackWhatWasSent) {
  const FrameIndex want = test::good_frame();
  frame_index_t m;
  fill(m, want);
  const Bytes b = bytes_of(m);
  const auto got = decode_frame_index(b.data(), b.size());
  ASSERT_TRUE(got.ok());
  EXPECT_EQ(got->info.seq, want.info.seq);
  EXPECT_EQ(got->info.camera_frame_id, want.info.camera_frame_id);
  EXPECT_EQ(got->info.camera_tick_ns, want.info.camera_tick_ns);
  EXPECT_EQ(got->info.t_arrival, want.info.t_arrival);
  EXPECT_EQ(got->info.t_mid, want.info.t_mid);
  EXPECT_EQ(got->info.t_mid_sigma, want.info.t_mid_sigma);
  EXPECT_EQ(got->info.exposure, want.info.exposure);
  EXPECT_EQ(got->info.time_source, want.info.time_source);
  EXPECT_EQ(got->info.status, want.info.status);
  EXPECT_EQ(got->info.missing_rows, want.info.missing_rows);
  EXPECT_EQ(got->format, want.format);
  EXPECT_EQ(got->width, want.width);
  EXPECT_EQ(got->height, want.height);
  EXPECT_EQ(got->recorded_in, want.recorded_in);
  EXPECT_EQ(got->recorded_at, want.recorded_at);
  EXPECT_EQ(Bytes(got->thumbnail_jpeg.begin(), got->thumbnail_jpeg.end()), (Bytes{0xff, 0xd8, 0xff}));
}

TEST(DecodeFrameData, ShowsThePixelsWithoutCopyingThem) {
  Bytes pixels(16 * 20 * 2);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i);
  const FrameDataView want = test::good_frame_data(pixels);
  const Bytes b = test::frame_data_bytes(want);
  const auto got = decode_frame_data(b.data(), b.size());
  ASSERT_TRUE(got.ok());
  EXPECT_EQ(got->camera_frame_id, want.camera_frame_id);
  EXPECT_EQ(got->camera_tick_ns, want.camera_tick_ns);
  EXPECT_EQ(got->exposure, want.exposure);
  EXPECT_EQ(got->status, FrameStatus::kPartial);
  EXPECT_EQ(got->missing.count(), 2);
  EXPECT_TRUE(got->missing.missing(3) && got->missing.missing(19));
  EXPECT_EQ(got->pixels.data() + got->pixels.size(), b.data() + b.size());
  EXPECT_EQ(Bytes(got->pixels.begin(), got->pixels.end()), pixels);
  EXPECT_FALSE(got->aligned());  // three mask bytes in front of 16-bit pixels
}

TEST(DecodeFrameData, ReadsWhatTheGeneratedEncoderWrites) {
  frame_data_t m{};
  m.camera_frame_id = 3;
  m.pixel_format = 0;
  m.width_px = 4;
  m.height_px = 2;
  m.size_bytes = 8;
  m.pixels = {1, 2, 3, 4, 5, 6, 7, 8};
  const Bytes b = bytes_of(m);
  const auto got = decode_frame_data(b.data(), b.size());
  ASSERT_TRUE(got.ok());
  ASSERT_TRUE(got->aligned());
  EXPECT_EQ(got->image().row8(1)[2], 7);
  EXPECT_EQ(test::frame_data_bytes(*got), b);
}

TEST(DecodeFrameData, RefusesSizesAndMasksThatDoNotFit) {
  Bytes pixels(16 * 20 * 2);
  FrameDataView f = test::good_frame_data(pixels);
  f.width = 15;
  Bytes b = test::frame_data_bytes(f);
  expect_error(decode_frame_data(b.data(), b.size()), ErrorCode::kCorrupt, "FRAME_DATA: size_bytes is 640, expected 600");
  f = test::good_frame_data(pixels);
  f.missing.set_missing(21);
  b = test::frame_data_bytes(f);
  expect_error(decode_frame_data(b.data(), b.size()), ErrorCode::kCorrupt, "FRAME_DATA: missing_row_mask marks row 21 of 20");
  f = test::good_frame_data(pixels);
  f.status = FrameStatus::kComplete;
  b = test::frame_data_bytes(f);
  expect_error(decode_frame_data(b.data(), b.size()), ErrorCode::kInvalid, "FRAME_DATA: missing_row_mask marks rows of a frame that is COMPLETE");
  f = test::good_frame_data(pixels);
  f.status = FrameStatus::kMissing;
  b = test::frame_data_bytes(f);
  expect_error(decode_frame_data(b.data(), b.size()), ErrorCode::kCorrupt, "FRAME_DATA: size_bytes is 640, expected 0");
  f.pixels = {};
  b = test::frame_data_bytes(f);
  EXPECT_TRUE(decode_frame_data(b.data(), b.size()).ok());
}

}  // namespace
}  // namespace cyclops
