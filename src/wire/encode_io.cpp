// The messages that come in and go into files: FRAME, FRAME_DATA, EVENT, TSPI, STROBE, TIME_MARK, TRUTH.
#include <cyclops/frame_data_t.hpp>

#include <cstring>

#include "wire/encode.hpp"

namespace cyclops {
namespace {

template <class E>
std::int8_t code(E e) {
  return static_cast<std::int8_t>(e);
}

void put(double (&out)[3], const Vec3& v) {
  for (int i = 0; i < 3; ++i) out[i] = v[i];
}
void put(double (&out)[4], const Eigen::Quaterniond& q) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

std::size_t mask_bytes(const FrameDataView& f) {
  return f.missing.count() == 0 ? 0 : (static_cast<std::size_t>(f.height) + 7) / 8;
}
constexpr std::size_t kFrameDataFixed = 8 + 3 * 8 + 1 + 2 + 2 + 1 + 4 + 4;

/// Big-endian fields one after another; the caller has made sure of the room.
class Writer {
 public:
  explicit Writer(std::uint8_t* at) : at_(at) {}
  template <class T>
  void put(T value) {
    const auto bits = static_cast<std::uint64_t>(value);
    for (int shift = 8 * static_cast<int>(sizeof(T)) - 8; shift >= 0; shift -= 8) *at_++ = static_cast<std::uint8_t>(bits >> shift);
  }

 private:
  std::uint8_t* at_;
};

}  // namespace

void fill(frame_index_t& out, const FrameIndex& frame) {
  const FrameInfo& info = frame.info;
  out.seq = static_cast<std::int64_t>(info.seq);
  out.camera_frame_id = static_cast<std::int64_t>(info.camera_frame_id);
  out.mid_exposure_ns = info.t_mid.ns;
  out.mid_exposure_sigma_ns = info.t_mid_sigma.ns;
  out.camera_tick_ns = info.camera_tick_ns;
  out.arrival_ns = info.t_arrival.ns;
  out.exposure_ns = info.exposure.ns;
  out.status = code(info.status);
  out.time_source = code(info.time_source);
  out.pixel_format = code(frame.format);
  out.width_px = static_cast<std::int16_t>(frame.width);
  out.height_px = static_cast<std::int16_t>(frame.height);
  out.missing_rows = static_cast<std::int16_t>(info.missing_rows);
  out.recorded_in.assign(frame.recorded_in);
  out.recorded_at = frame.recorded_at;
  out.thumbnail_bytes = static_cast<std::int32_t>(frame.thumbnail_jpeg.size());
  out.thumbnail_jpeg.assign(frame.thumbnail_jpeg.begin(), frame.thumbnail_jpeg.end());
}

void fill(event_t& out, const Event& event) {
  out.service_time_ns = event.t.ns;
  out.level = code(event.level);
  out.source.assign(event.source);
  out.code.assign(event.code);
  out.text.assign(event.text);
  out.count = event.count;
}

void fill(tspi_t& out, const TspiReport& r) {
  out.gps_time_ns = r.t_gps.ns;
  out.seq = static_cast<std::int32_t>(r.seq);
  out.aircraft = code(r.aircraft);
  out.status = r.degraded ? tspi_t::STATUS_DEGRADED : tspi_t::STATUS_GOOD;
  out.latitude_deg = r.latitude_deg;
  out.longitude_deg = r.longitude_deg;
  out.height_m = r.height_m;
  put(out.velocity_ned_mps, r.velocity_ned_mps);
  put(out.q_n_b, r.q_n_b);
  put(out.rate_b_rps, r.rate_b_rps);
  put(out.position_sigma_m, r.position_sigma_m);
  put(out.velocity_sigma_mps, r.velocity_sigma_mps);
  put(out.attitude_sigma_rad, r.attitude_sigma_rad);
}

void fill(strobe_edge_t& out, const LineEdge& e) {
  out.service_time_ns = e.edge.t.ns;
  out.line_seq = e.edge.line_seq;
  out.edge = e.edge.rising ? strobe_edge_t::RISING : strobe_edge_t::FALLING;
  out.line = code(e.line);
}

void fill(time_mark_t& out, const TimeMark& mark, MarkSource source) {
  out.service_time_ns = mark.t.ns;
  out.gps_time_ns = mark.t_gps.ns;
  out.sigma_ns = mark.sigma.ns;
  out.source = code(source);
}

void fill(acquisition_t& out, const Acquisition& change) {
  out.service_time_ns = change.t.ns;
  out.what = code(change.what);
}

void fill(mark_t& out, const Mark& mark) {
  out.seq = mark.seq;
  out.text.assign(mark.text);
}

void fill(seal_t& out, const Seal& seal) {
  out.from_byte = seal.from;
  out.to_byte = seal.to;
  out.xxh3 = static_cast<std::int64_t>(seal.sum);
}

void fill(truth_t& out, const Truth& truth) {
  out.camera_frame_id = static_cast<std::int64_t>(truth.camera_frame_id);
  out.mid_exposure_ns = truth.t_mid.ns;
  out.exposure_ns = truth.exposure.ns;
  out.has_pose = truth.has_pose ? 1 : 0;
  put(out.t_r_k_m, truth.T_r_k.translation().xyz);
  put(out.q_r_k, truth.T_r_k.rotation().quaternion());
  put(out.sun_c, truth.sun_c);
  const std::size_t n = truth.points.size(), detail = truth.has_detail ? n : 0;
  out.n = static_cast<std::int32_t>(n);
  out.id.resize(n);
  out.u_px.resize(n);
  out.v_px.resize(n);
  out.visible.resize(n);
  out.n_detail = static_cast<std::int32_t>(detail);
  out.reasons.resize(detail);
  out.ideal_u_px.resize(detail);
  out.ideal_v_px.resize(detail);
  for (std::size_t i = 0; i < n; ++i) {
    const TruthPoint& p = truth.points[i];
    out.id[i] = p.id;
    out.u_px[i] = p.uv_px.x();
    out.v_px[i] = p.uv_px.y();
    out.visible[i] = code(p.visibility);
  }
  for (std::size_t i = 0; i < detail; ++i) {
    const TruthPoint& p = truth.points[i];
    out.reasons[i] = static_cast<std::int16_t>(p.reasons);
    out.ideal_u_px[i] = p.ideal_px.x();
    out.ideal_v_px[i] = p.ideal_px.y();
  }
}

std::size_t encoded_size(const FrameDataView& f) { return kFrameDataFixed + mask_bytes(f) + f.pixels.size(); }

Encoded encode_head_into(const FrameDataView& f, std::span<std::uint8_t> buffer) {
  const std::size_t need = encoded_size(f) - f.pixels.size(), mask = mask_bytes(f);
  if (need > buffer.size()) return {};
  Writer out(buffer.data());
  out.put(frame_data_t::getHash());
  out.put(static_cast<std::int64_t>(f.camera_frame_id));
  out.put(f.camera_tick_ns);
  out.put(f.exposure.ns);
  out.put(code(f.format));
  out.put(static_cast<std::int16_t>(f.width));
  out.put(static_cast<std::int16_t>(f.height));
  out.put(code(f.status));
  out.put(static_cast<std::int32_t>(mask));
  for (std::size_t b = 0; b < mask; ++b) out.put(static_cast<std::uint8_t>(f.missing.bits[b / 8] >> (8 * (b % 8))));
  out.put(static_cast<std::int32_t>(f.pixels.size()));
  return {buffer.data(), need};
}

Encoded encode_into(const FrameDataView& f, std::span<std::uint8_t> buffer) {
  const std::size_t need = encoded_size(f);
  if (need > buffer.size()) return {};
  const Encoded head = encode_head_into(f, buffer);
  if (!f.pixels.empty()) std::memcpy(buffer.data() + head.size, f.pixels.data(), f.pixels.size());
  return {buffer.data(), need};
}

}  // namespace cyclops
