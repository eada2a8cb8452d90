#include "publish/measure.hpp"

#include <algorithm>

namespace cyclops {
namespace {

/// What the frame amounts to.
struct Tally {
  double expected{0};
  double matched{0};
  double typical{0};
  double accepted{0};
};

double integrity(const Tally& n, const PublishConfig& config) {
  if (n.accepted == 0) return 0;
  const double share = n.accepted / n.expected;
  const double consistency = std::min(1.0, n.typical / n.matched / 0.95);
  const double number = std::min(1.0, n.accepted / config.enough_features);
  return share * consistency * number;
}

void fill_innovation(const Track& predicted, const Corner& corner, Measurement& m) {
  m.innovation_px = corner.uv_px - predicted.uv_px;
  m.innovation_cov_px2 = predicted.cov_px2 + corner.cov_px2;
  const Mat2& S = m.innovation_cov_px2;
  m.nis = S.determinant() > 0 ? m.innovation_px.dot(S.inverse() * m.innovation_px) : 0;
}

void fill_point(const Corner& corner, const Camera& camera, Measurement& m) {
  m.kind = corner.kind;
  m.raw_px = corner.uv_px;
  m.ideal_px = camera.ideal_from_raw(corner.uv_px);
  m.z_m = camera.z_point_m(m.ideal_px);
  const Mat2 J = camera.ideal_from_raw_jacobian(corner.uv_px);
  m.cov_px2 = J * corner.cov_px2 * J.transpose();
  m.corner_measure = corner.measure;
}

Measurement measure_one(const Track& predicted, const Match& match, const CornerSet& corners, const Camera& camera, const PublishConfig& config) {
  Measurement m;
  m.id = predicted.id;
  m.feature = predicted.feature;
  m.reason = match.reason;
  m.gate_px = match.gate_px;
  if (match.corner < 0) return m;
  const Corner& corner = corners.items[static_cast<std::size_t>(match.corner)];
  fill_point(corner, camera, m);
  fill_innovation(predicted, corner, m);
  m.accepted = config.max_nis == 0 || m.nis <= config.max_nis;
  if (!m.accepted) m.reason = MatchReason::kInnovation;
  return m;
}

}  // namespace

Result<PublishConfig> PublishConfig::read(ConfigTable& table, PublishConfig c) {
  table.read_in("max_nis", 0.0, 1e6, c.max_nis);
  table.read_in("apart_sigmas", 0.0, 10.0, c.apart_sigmas);
  table.read_in("typical_nis", 0.1, 100.0, c.typical_nis);
  table.read_in("enough_features", 1, 1024, c.enough_features);
  return c;
}

void measure(const TrackSet& predicted, const MatchSet& matches, const CornerSet& corners, const Camera& camera,
             const PublishConfig& config, MeasurementSet& out) {
  CYCLOPS_ASSERT(matches.size() == predicted.size());
  out.seq = corners.seq;
  out.t_mid = corners.t_mid;
  out.items.clear();
  Tally n;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i].reason == MatchReason::kNotVisible) continue;
    const Measurement m = measure_one(predicted[i], matches[i], corners, camera, config);
    n.expected += 1;
    n.accepted += m.accepted ? 1 : 0;
    if (matches[i].corner >= 0) {
      n.matched += 1;
      n.typical += m.nis <= config.typical_nis ? 1 : 0;
    }
    out.items.push_back(m);
  }
  out.integrity = integrity(n, config);
}

void refuse_confusable(const TrackSet& predicted, const MatchSet& matches, double apart_sigmas, MeasurementSet& set) {
  if (apart_sigmas == 0) return;
  const auto confused = [&](const Measurement& m) {
    for (std::size_t i = 0; i < predicted.size(); ++i) {
      if (predicted[i].feature == m.feature || matches[i].reason == MatchReason::kNotVisible) continue;
      const Vec2 way = predicted[i].uv_px - m.raw_px;
      const double square = way.squaredNorm();
      if (square * square < 4 * apart_sigmas * apart_sigmas * way.dot(m.cov_px2 * way)) return true;
    }
    return false;
  };
  for (Measurement& m : set.items) {
    if (!m.accepted || !confused(m)) continue;
    m.accepted = false;
    m.reason = MatchReason::kAmbiguous;
  }
}

void z_matrix(const MeasurementSet& set, double t_s, ZMatrix& out) {
  out.clear();
  out.push_back({t_s, 1, 1});
  for (const Measurement& m : set.items)
    if (m.accepted) out.push_back({static_cast<double>(m.id), m.z_m.x(), m.z_m.y()});
}

}  // namespace cyclops
