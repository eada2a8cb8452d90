#include "wire/decode.hpp"

#include <cyclops/acquisition_t.hpp>
#include <cyclops/event_t.hpp>
#include <cyclops/mark_t.hpp>
#include <cyclops/seal_t.hpp>
#include <cyclops/strobe_edge_t.hpp>
#include <cyclops/time_mark_t.hpp>
#include <cyclops/truth_t.hpp>
#include <cyclops/tspi_t.hpp>

#include <algorithm>

#include "wire/channels.hpp"
#include "wire/reader.hpp"

namespace cyclops {
namespace {

using wire::Reader;

constexpr double kFarPixel = 1e6;     // px; a point of truth may lie outside the image
constexpr int kAllReasons = 2 * truth_t::BLOWN_OUT - 1;
constexpr double kUnitNorm = 1e-6;    // how far a direction may be from length 1
constexpr std::size_t kMaxName = 255;
constexpr std::size_t kMaxText = 4095;

template <class M>
Reader open(const char* channel, const void* data, std::size_t size) {
  return {channel, M::getTypeName(), M::getHash(), data, size};
}

Time time(Reader& in, const char* field) { return {in.whole(field, -kMaxTime_ns, kMaxTime_ns)}; }

void check_sender(Reader& in, std::int8_t aircraft, std::int8_t status, Aircraft expected) {
  if (aircraft != static_cast<std::int8_t>(expected))
    in.fail(ErrorCode::kInvalid, "aircraft", "is " + std::to_string(aircraft) + ", expected " + std::to_string(static_cast<int>(expected)) + " on this channel");
  if (status == tspi_t::STATUS_INVALID) in.fail(ErrorCode::kUnusable, "status", "is INVALID");
  if (status < tspi_t::STATUS_GOOD || status > tspi_t::STATUS_INVALID)
    in.fail(ErrorCode::kInvalid, "status", "is " + std::to_string(status) + ", expected 0 to 2");
}

void read_pose(Reader& in, Truth& out) {
  out.has_pose = in.flag("has_pose");
  Vec3 t;
  for (int i = 0; i < 3; ++i) t[i] = in.get<double>("t_r_k_m");
  Eigen::Quaterniond q(1, 0, 0, 0);
  if (out.has_pose) q = in.quaternion<Eigen::Quaterniond>("q_r_k", tspi_limits::kQuaternionNorm);
  else in.take("q_r_k", 32);
  if (out.has_pose && !(t.norm() < 1e6)) in.fail(ErrorCode::kInvalid, "t_r_k_m", "is not finite or longer than 1000 km");
  out.T_r_k = out.has_pose ? Pose<frame::R, frame::K>(Rotation<frame::R, frame::K>(q), Point<frame::R>(t)) : Pose<frame::R, frame::K>();
}

void read_detail(Reader& in, Truth& out) {
  const std::size_t n = in.length("n_detail", kMaxFeatures);
  if (in.ok() && n != 0 && n != out.points.size())
    in.fail(ErrorCode::kCorrupt, "n_detail", "is " + std::to_string(n) + ", expected 0 or n = " + std::to_string(out.points.size()));
  out.has_detail = n != 0;
  if (!in.ok() || !out.has_detail) return;
  for (TruthPoint& p : out.points) p.reasons = static_cast<std::uint32_t>(in.small<std::int16_t>("reasons", 0, kAllReasons));
  for (TruthPoint& p : out.points) p.ideal_px.x() = in.real("ideal_u_px", -kFarPixel, kFarPixel);
  for (TruthPoint& p : out.points) p.ideal_px.y() = in.real("ideal_v_px", -kFarPixel, kFarPixel);
}

}  // namespace

Result<TspiReport> decode_tspi(const void* data, std::size_t size, Aircraft expected) {
  namespace limit = tspi_limits;
  Reader in = open<tspi_t>(channel::tspi(expected), data, size);
  TspiReport r;
  r.t_gps = {in.whole("gps_time_ns", 0, kMaxTime_ns)};
  r.seq = static_cast<std::uint32_t>(in.get<std::int32_t>("seq"));
  r.aircraft = expected;
  const auto aircraft = in.get<std::int8_t>("aircraft");
  const auto status = in.get<std::int8_t>("status");
  if (in.ok()) check_sender(in, aircraft, status, expected);
  r.degraded = status == tspi_t::STATUS_DEGRADED;
  r.latitude_deg = in.real("latitude_deg", -90, 90);
  r.longitude_deg = in.real("longitude_deg", -180, 180);
  r.height_m = in.real("height_m", limit::kHeightLow_m, limit::kHeightHigh_m);
  r.velocity_ned_mps = in.vector<Vec3>("velocity_ned_mps", limit::kSpeed_mps);
  r.q_n_b = in.quaternion<Eigen::Quaterniond>("q_n_b", limit::kQuaternionNorm);
  r.rate_b_rps = in.vector<Vec3>("rate_b_rps", limit::kRate_rps);
  r.position_sigma_m = in.sigmas<Vec3>("position_sigma_m", limit::kPositionSigma_m);
  r.velocity_sigma_mps = in.sigmas<Vec3>("velocity_sigma_mps", limit::kVelocitySigma_mps);
  r.attitude_sigma_rad = in.sigmas<Vec3>("attitude_sigma_rad", limit::kAttitudeSigma_rad);
  in.finish();
  if (!in.ok()) return in.error();
  return r;
}

Result<LineEdge> decode_strobe_edge(const void* data, std::size_t size) {
  Reader in = open<strobe_edge_t>(channel::kStrobe, data, size);
  LineEdge out;
  out.edge.t = time(in, "service_time_ns");
  out.edge.line_seq = in.whole("line_seq", -1, kMaxTime_ns);
  out.edge.rising = in.small<std::int8_t>("edge", strobe_edge_t::FALLING, strobe_edge_t::RISING) == strobe_edge_t::RISING;
  out.line = static_cast<StrobeLine>(in.small<std::int8_t>("line", 0, 1));
  in.finish();
  if (!in.ok()) return in.error();
  return out;
}

Result<SourcedMark> decode_time_mark(const void* data, std::size_t size) {
  Reader in = open<time_mark_t>(channel::kTimeMark, data, size);
  SourcedMark out;
  out.mark.t = time(in, "service_time_ns");
  out.mark.t_gps = {in.whole("gps_time_ns", 0, kMaxTime_ns)};
  out.mark.sigma = {in.whole("sigma_ns", 0, 60'000'000'000)};
  out.source = static_cast<MarkSource>(in.small<std::int8_t>("source", time_mark_t::PPS, time_mark_t::RECORDED));
  in.finish();
  if (!in.ok()) return in.error();
  return out;
}

Result<> decode_truth(const void* data, std::size_t size, Truth& out) {
  Reader in = open<truth_t>(channel::kTruth, data, size);
  out.camera_frame_id = static_cast<std::uint64_t>(in.whole("camera_frame_id", 0, kMaxTime_ns));
  out.t_mid = time(in, "mid_exposure_ns");
  out.exposure = {in.whole("exposure_ns", 0, kMaxExposure_ns)};
  read_pose(in, out);
  out.sun_c = in.vector<Vec3>("sun_c", 1 + kUnitNorm);
  if (in.ok() && out.sun_c.norm() != 0 && out.sun_c.norm() < 1 - kUnitNorm) in.fail(ErrorCode::kInvalid, "sun_c", "is neither a unit vector nor zero");
  const std::size_t n = in.length("n", kMaxFeatures);
  out.points.clear();
  out.points.resize(n);
  for (TruthPoint& p : out.points) p.id = in.get<std::int32_t>("id");
  for (TruthPoint& p : out.points) p.uv_px.x() = in.real("u_px", -kFarPixel, kFarPixel);
  for (TruthPoint& p : out.points) p.uv_px.y() = in.real("v_px", -kFarPixel, kFarPixel);
  for (TruthPoint& p : out.points)
    p.visibility = static_cast<TruthVisibility>(in.small<std::int8_t>("visible", truth_t::HIDDEN, truth_t::DO_NOT_SCORE));
  read_detail(in, out);
  in.finish();
  if (!in.ok()) return in.error();
  return Ok{};
}

Result<Acquisition> decode_acquisition(const void* data, std::size_t size) {
  Reader in = open<acquisition_t>(channel::kAcquisition, data, size);
  Acquisition out;
  out.t = {in.get<std::int64_t>("service_time_ns")};
  if (out.t.ns != INT64_MIN && (out.t.ns < -kMaxTime_ns || out.t.ns > kMaxTime_ns))
    in.fail(ErrorCode::kInvalid, "service_time_ns", "is " + std::to_string(out.t.ns) + ", expected a time or the least int64");
  out.what = static_cast<AcquisitionChange>(in.small<std::int8_t>("what", acquisition_t::STARTED, acquisition_t::SILENT));
  in.finish();
  if (!in.ok()) return in.error();
  return out;
}

Result<Mark> decode_mark(const void* data, std::size_t size) {
  Reader in = open<mark_t>(channel::kMark, data, size);
  Mark out;
  out.seq = in.get<std::int32_t>("seq");
  out.text = in.text("text", Mark::kMaxText);
  in.finish();
  const auto unprintable = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  if (in.ok() && std::any_of(out.text.begin(), out.text.end(), unprintable)) in.fail(ErrorCode::kInvalid, "text", "holds a control character");
  if (!in.ok()) return in.error();
  return out;
}

Result<Seal> decode_seal(const void* data, std::size_t size) {
  Reader in = open<seal_t>(channel::kSeal, data, size);
  Seal out;
  out.from = in.whole("from_byte", 0, kMaxTime_ns);
  out.to = in.whole("to_byte", 0, kMaxTime_ns);
  out.sum = static_cast<std::uint64_t>(in.get<std::int64_t>("xxh3"));
  in.finish();
  if (!in.ok()) return in.error();
  return out;
}

Result<Event> decode_event(const void* data, std::size_t size) {
  Reader in = open<event_t>(channel::kEvent, data, size);
  Event out;
  out.t = time(in, "service_time_ns");
  out.level = static_cast<EventLevel>(in.small<std::int8_t>("level", event_t::INFO, event_t::MARK));
  out.source = in.text("source", kMaxName);
  out.code = in.text("code", kMaxName);
  out.text = in.text("text", kMaxText);
  out.count = in.whole("count", 0, kMaxTime_ns);
  in.finish();
  if (!in.ok()) return in.error();
  return out;
}

}  // namespace cyclops
