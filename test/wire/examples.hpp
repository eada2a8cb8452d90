#pragma once
/// One good message of each kind that comes in, and what to say of a bad one.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "wire/codec.hpp"

namespace cyclops::test {

template <class Message>
std::vector<std::uint8_t> bytes_of(const Message& message) {
  std::vector<std::uint8_t> out(static_cast<std::size_t>(message.getEncodedSize()));
  const Encoded e = encode_into(message, out);
  CYCLOPS_ASSERT(e.size == out.size());
  return out;
}

template <class R>
void expect_error(const R& result, ErrorCode code, const std::string& message) {
  ASSERT_FALSE(result.ok()) << "expected: " << message;
  EXPECT_EQ(result.error().code, code) << result.error().message();
  EXPECT_EQ(result.error().message().substr(0, message.size()), message);
}

inline TspiReport good_report() {
  TspiReport r;
  r.aircraft = Aircraft::kTanker;
  r.seq = 41;
  r.t_gps = {1'443'000'000'000'000'123};
  r.latitude_deg = 34.9;
  r.longitude_deg = -117.9;
  r.height_m = 7000.25;
  r.velocity_ned_mps = {150, -20, 1.5};
  r.q_n_b = Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5);
  r.rate_b_rps = {0.01, -0.02, 0.03};
  r.position_sigma_m = {0.1, 0.2, 0.3};
  r.velocity_sigma_mps = {0.01, 0.02, 0.03};
  r.attitude_sigma_rad = {0.001, 0.002, 0.003};
  return r;
}

inline tspi_t good_tspi() {
  tspi_t m;
  fill(m, good_report());
  return m;
}

inline FrameIndex good_frame() {
  static const std::uint8_t jpeg[] = {0xff, 0xd8, 0xff};
  FrameIndex f;
  f.info.seq = 7;
  f.info.camera_frame_id = 9;
  f.info.camera_tick_ns = 123456789;
  f.info.t_arrival = {5'040'000'000};
  f.info.t_mid = {5'002'000'000};
  f.info.t_mid_sigma = {12000};
  f.info.exposure = {4'000'000};
  f.info.time_source = TimeSource::kCameraTick;
  f.info.status = FrameStatus::kPartial;
  f.info.missing_rows = 3;
  f.format = PixelFormat::kMono12;
  f.width = 64;
  f.height = 20;
  f.recorded_in = "frames.lcm";
  f.recorded_at = 17;
  f.thumbnail_jpeg = jpeg;
  return f;
}

inline std::vector<std::uint8_t> frame_data_bytes(const FrameDataView& f) {
  std::vector<std::uint8_t> out(encoded_size(f));
  CYCLOPS_ASSERT(encode_into(f, out).size == out.size());
  return out;
}

inline FrameDataView good_frame_data(const std::vector<std::uint8_t>& pixels) {
  FrameDataView f;
  f.camera_frame_id = 9;
  f.camera_tick_ns = 123456789;
  f.exposure = {4'000'000};
  f.status = FrameStatus::kPartial;
  f.format = PixelFormat::kMono12;
  f.width = 16;
  f.height = 20;
  f.missing.set_missing(3);
  f.missing.set_missing(19);
  f.pixels = pixels;  // 16 * 20 * 2 bytes
  return f;
}

inline Truth good_truth() {
  Truth t;
  t.camera_frame_id = 9;
  t.t_mid = {5'002'000'000};
  t.has_pose = true;
  t.exposure = {4'000'000};
  t.T_r_k = Pose<frame::R, frame::K>(Rotation<frame::R, frame::K>(so3_exp({0.1, 0.2, -0.3})), Point<frame::R>(33, 0.1, -5));
  t.sun_c = {0.36, -0.48, 0.8};
  t.has_detail = true;
  t.points.push_back({2, {511.5, 529.68}, TruthVisibility::kVisible, truth_t::IN_SHADOW | truth_t::SATURATED, {510.25, 528}});
  t.points.push_back({15, {816.72, 613.75}, TruthVisibility::kDoNotScore, truth_t::SATURATED | truth_t::BLOWN_OUT, {815, 612.5}});
  return t;
}

inline Event good_event() { return {{77}, EventLevel::kFault, "tspi.receiver", "tspi.nan", "latitude_deg is nan", 3}; }

}  // namespace cyclops::test
