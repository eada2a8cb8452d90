#include "wire/encode.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cyclops {
namespace {

template <class E>
std::int8_t code(E e) {
  return static_cast<std::int8_t>(e);
}
float single(double x) { return static_cast<float>(x); }
std::int16_t clamped16(int x) {
  return static_cast<std::int16_t>(std::clamp<int>(x, std::numeric_limits<std::int16_t>::min(), std::numeric_limits<std::int16_t>::max()));
}

template <class T, std::size_t N>
void put(T (&out)[N], const Eigen::Matrix<double, static_cast<int>(N), 1>& v) {
  for (std::size_t i = 0; i < N; ++i) out[i] = static_cast<T>(v[static_cast<int>(i)]);
}
template <class T>
void put_quaternion(T (&out)[4], const Eigen::Quaterniond& q) {
  out[0] = static_cast<T>(q.w());
  out[1] = static_cast<T>(q.x());
  out[2] = static_cast<T>(q.y());
  out[3] = static_cast<T>(q.z());
}
template <class T>
void put_symmetric(T (&out)[3], const Mat2& m) {
  out[0] = static_cast<T>(m(0, 0));
  out[1] = static_cast<T>(0.5 * (m(0, 1) + m(1, 0)));
  out[2] = static_cast<T>(m(1, 1));
}

template <class Set>
std::int32_t count(const Set& set) {
  return static_cast<std::int32_t>(set.size());
}

/// Square root of the larger eigenvalue.
double larger_sigma(const Mat2& m) {
  const double mean = 0.5 * (m(0, 0) + m(1, 1));
  const double half = std::hypot(0.5 * (m(0, 0) - m(1, 1)), 0.5 * (m(0, 1) + m(1, 0)));
  return std::sqrt(std::max(0.0, mean + half));
}

void fill(prediction_t& out, const Prediction& p, float gate_px) {
  out.id = p.id;
  out.visibility = code(p.visibility);
  put(out.uv_px, p.uv_px);
  put_symmetric(out.cov_px2, p.cov_px2);
  out.gate_px = gate_px;
}

void fill(track_t& out, const Track& t) {
  out.id = t.id;
  out.state = code(t.state);
  out.change = code(t.change);
  put(out.uv_px, t.uv_px);
  put(out.velocity_px_s, t.velocity_px_s);
  put_symmetric(out.cov_px2, t.cov_px2);
  out.score = clamped16(t.score);
  out.last_hit_ns = t.t_last_hit.ns;
}

void fill(measurement_t& out, const Measurement& m) {
  out.id = m.id;
  out.accepted = m.accepted ? 1 : 0;
  out.reason = code(m.reason);
  out.kind = code(m.kind);
  put(out.z_m, m.z_m);
  put(out.raw_px, m.raw_px);
  put(out.ideal_px, m.ideal_px);
  put_symmetric(out.cov_px2, m.cov_px2);
  put(out.innovation_px, m.innovation_px);
  put_symmetric(out.innovation_cov_px2, m.innovation_cov_px2);
  out.nis = m.nis;
  out.corner_measure = m.corner_measure;
  out.gate_px = m.gate_px;
}

}  // namespace

void fill(nav_state_t& out, std::uint64_t seq, const RelativeState& state, NavAbsence absence, bool used) {
  out.seq = static_cast<std::int64_t>(seq);
  out.mid_exposure_ns = state.t.ns;
  out.valid = state.valid ? 1 : 0;
  out.used = used ? 1 : 0;
  out.extrapolated = state.extrapolated ? 1 : 0;
  out.absence = code(absence);
  out.age_receiver_ns = state.age_receiver.ns;
  out.age_tanker_ns = state.age_tanker.ns;
  put(out.t_r_k_m, state.T_r_k.translation().xyz);
  put_quaternion(out.q_r_k, state.T_r_k.rotation().quaternion());
  for (int i = 0; i < 36; ++i) out.covariance[i] = state.covariance(i / 6, i % 6);
}

void fill(prediction_set_t& out, const PredictionSet& set, const RelativeState* nav, double range_m, std::span<const float> gate_px) {
  const RelativeState& state = nav != nullptr ? *nav : RelativeState{};
  out.seq = static_cast<std::int64_t>(set.seq);
  out.mid_exposure_ns = set.t_mid.ns;
  out.from_nav = set.from_nav ? 1 : 0;
  out.nav_extrapolated = state.extrapolated ? 1 : 0;
  put(out.t_r_k_m, state.T_r_k.translation().xyz);
  put_quaternion(out.q_r_k, state.T_r_k.rotation().quaternion());
  out.range_m = single(range_m);
  out.n = count(set.items);
  out.items.resize(set.items.size());
  for (std::size_t i = 0; i < set.items.size(); ++i) fill(out.items[i], set.items[i], i < gate_px.size() ? gate_px[i] : 0);
}

void fill(subimage_set_t& out, std::uint64_t seq, Time t_mid, const SubImageSet& set, std::int64_t image_px) {
  out.seq = static_cast<std::int64_t>(seq);
  out.mid_exposure_ns = t_mid.ns;
  out.n = count(set);
  for (auto* column : {&out.u0_px, &out.v0_px, &out.width_px, &out.height_px}) column->resize(set.size());
  std::int64_t area = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    out.u0_px[i] = clamped16(set[i].u0);
    out.v0_px[i] = clamped16(set[i].v0);
    out.width_px[i] = clamped16(set[i].width);
    out.height_px[i] = clamped16(set[i].height);
    area += static_cast<std::int64_t>(set[i].width) * set[i].height;
  }
  out.area_share = image_px > 0 ? single(static_cast<double>(area) / static_cast<double>(image_px)) : 0;
}

void fill(corner_set_t& out, const CornerSet& set, std::size_t most) {
  std::array<std::uint16_t, kMaxCorners> order;  // NOLINT: only the first size() are set and used
  static_assert(kMaxCorners <= 65536);
  const std::size_t all = set.items.size(), n = std::min(most, all);
  for (std::size_t i = 0; i < all; ++i) order[i] = static_cast<std::uint16_t>(i);
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(n), order.begin() + static_cast<std::ptrdiff_t>(all),
                    [&](std::uint16_t a, std::uint16_t b) {
                      const Corner &x = set.items[a], &y = set.items[b];
                      const bool x_corner = x.kind == PointKind::kCorner, y_corner = y.kind == PointKind::kCorner;
                      if (x_corner != y_corner) return y_corner;
                      return x.measure != y.measure ? x.measure > y.measure : a < b;
                    });
  out.seq = static_cast<std::int64_t>(set.seq);
  out.mid_exposure_ns = set.t_mid.ns;
  out.found = static_cast<std::int32_t>(all + set.overflow);
  out.overflow = static_cast<std::int32_t>(set.overflow);
  out.n = static_cast<std::int32_t>(n);
  for (auto* column : {&out.u_px, &out.v_px, &out.sigma_px, &out.measure}) column->resize(n);
  out.kind.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Corner& c = set.items[order[i]];
    out.u_px[i] = single(c.uv_px.x());
    out.v_px[i] = single(c.uv_px.y());
    out.sigma_px[i] = single(larger_sigma(c.cov_px2));
    out.measure[i] = c.measure;
    out.kind[i] = code(c.kind);
  }
}

void fill(track_set_t& out, std::uint64_t seq, Time t_mid, const TrackSet& set) {
  out.seq = static_cast<std::int64_t>(seq);
  out.mid_exposure_ns = t_mid.ns;
  out.n = count(set);
  out.items.resize(set.size());
  for (std::size_t i = 0; i < set.size(); ++i) fill(out.items[i], set[i]);
}

void fill(measurement_set_t& out, const MeasurementSet& set, TimeSource source, std::optional<GpsTime> t_mid_gps) {
  out.seq = static_cast<std::int64_t>(set.seq);
  out.mid_exposure_ns = set.t_mid.ns;
  out.mid_exposure_gps_ns = t_mid_gps ? t_mid_gps->ns : 0;
  out.mid_exposure_sigma_ns = set.t_mid_sigma.ns;
  out.time_source = code(source);
  out.integrity = single(set.integrity);
  out.n = count(set.items);
  out.items.resize(set.items.size());
  out.accepted = 0;
  for (std::size_t i = 0; i < set.items.size(); ++i) {
    fill(out.items[i], set.items[i]);
    out.accepted += set.items[i].accepted ? 1 : 0;
  }
}

Outbox::Outbox() {
  frame.recorded_in.reserve(256);
  frame.thumbnail_jpeg.reserve(std::size_t{1} << 16);
  event.source.reserve(256);
  event.code.reserve(256);
  event.text.reserve(4096);
  prediction.items.reserve(kMaxFeatures);
  for (auto* column : {&subimage.u0_px, &subimage.v0_px, &subimage.width_px, &subimage.height_px}) column->reserve(kMaxSubImages);
  for (auto* column : {&corner.u_px, &corner.v_px, &corner.sigma_px, &corner.measure}) column->reserve(kMaxSentCorners);
  corner.kind.reserve(kMaxSentCorners);
  track.items.reserve(kMaxFeatures);
  measurement.items.reserve(kMaxFeatures);
}

}  // namespace cyclops
