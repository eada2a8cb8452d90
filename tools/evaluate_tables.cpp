#include "tools/evaluate_tables.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include <nlohmann/json.hpp>

#include "tools/score.hpp"
#include "tools/true_pose.hpp"

namespace cyclops::tools {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

constexpr const char* kFeatureColumns =
    "('frame','<i4'),('id','<i4'),('truth','i1'),('predicted','i1'),('before','i1'),('measured','i1'),('kind','i1'),('reason','i1'),"
    "('track_state','i1'),('track_change','i1'),('true_u','<f8'),('true_v','<f8'),('true_ideal_u','<f8'),('true_ideal_v','<f8'),"
    "('u','<f8'),('v','<f8'),('ideal_u','<f8'),('ideal_v','<f8'),('predicted_u','<f4'),('predicted_v','<f4'),('before_u','<f4'),"
    "('before_v','<f4'),('cov_uu','<f4'),('cov_uv','<f4'),('cov_vv','<f4'),('nis','<f4'),('nearest_other','<f4')";
constexpr const char* kFrameColumns =
    "('t_mid_ns','<i8'),('has_truth','i1'),('nav_update','i1'),('consensus','i1'),('nav_suspect','i1'),('has_pose','i1'),"
    "('integrity','<f4'),('range_m','<f4'),('chain_us','<f4'),('stage_us','<f4',(9,)),('pose_t','<f8',(3,)),('pose_q','<f8',(4,))";
static_assert(sizeof(FeatureRow) == 16 + 8 * 8 + 9 * 4);
static_assert(sizeof(FrameRow) == 8 + 5 + 3 * 4 + 9 * 4 + 7 * 8 && kStages == 9);

template <class Set>
auto find(const Set& set, FeatureId id) {
  auto it = set.begin();
  while (it != set.end() && it->id != id) ++it;
  return it;
}

bool in_image(Visibility v) { return v == Visibility::kVisible || v == Visibility::kFacingAway || v == Visibility::kOutsideImage; }

void add_prediction(const FrameOutput& out, FeatureRow& row) {
  const auto p = find(out.predictions.items, row.id);
  row.predicted = p != out.predictions.items.end() && in_image(p->visibility) ? 1 : 0;
  row.predicted_u = row.predicted ? static_cast<float>(p->uv_px.x()) : kNone;
  row.predicted_v = row.predicted ? static_cast<float>(p->uv_px.y()) : kNone;
}

void add_tracks(const FrameOutput& out, FeatureRow& row) {
  const auto before = find(out.tracks_before, row.id);
  row.before = before != out.tracks_before.end() && (before->state == TrackState::kLive || before->state == TrackState::kCoasting) ? 1 : 0;
  row.before_u = row.before ? static_cast<float>(before->uv_px.x()) : kNone;
  row.before_v = row.before ? static_cast<float>(before->uv_px.y()) : kNone;
  const auto after = find(out.tracks, row.id);
  if (after == out.tracks.end()) return;
  row.track_state = static_cast<std::int8_t>(after->state);
  row.track_change = static_cast<std::int8_t>(after->change);
}

float nearest_other(const std::vector<TruePoint>& all, FeatureId id, const Vec2& uv) {
  double best = std::numeric_limits<double>::infinity();
  for (const TruePoint& p : all)
    if (p.id != id && p.visible == truth_t::VISIBLE) best = std::min(best, (uv - p.uv_px).norm());
  return static_cast<float>(best);
}

std::vector<TruePoint> stated(const truth_t& t) {
  std::vector<TruePoint> out;
  for (std::size_t i = 0; i < t.id.size(); ++i)
    out.push_back({t.id[i], Vec2(t.u_px[i], t.v_px[i]), t.ideal_u_px.empty() ? Vec2(kNone, kNone) : Vec2(t.ideal_u_px[i], t.ideal_v_px[i]), t.visible[i]});
  return out;
}

/// The features in use that the truth has not: all of them from the same pose.
void add_learnt(const Rig& rig, const align::CameraPose& T_c_k, std::vector<TruePoint>& out) {
  const std::size_t known = out.size();
  for (const Feature& f : rig.tanker.features()) {
    if (!f.enabled || std::any_of(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(known), [&](const TruePoint& p) { return p.id == f.id; })) continue;
    const Point<frame::K> p_k = rig.tanker.in_body(f);
    const auto at = rig.camera.project(T_c_k * p_k);
    if (!at) continue;
    const Vec3 to_camera_k = T_c_k.inverse() * Point<frame::C>{} - p_k;
    const bool seen = rig.camera.inside(*at) && (!f.seen_from || f.seen_from->holds(TankerModel::direction_in_body(to_camera_k)));
    out.push_back({f.id, *at, rig.camera.ideal_from_raw(*at), seen ? truth_t::VISIBLE : truth_t::HIDDEN});
  }
}

/// The rig file's mount, which has the flight's boresight error.
align::CameraPose through_mount(const Rig& rig, const truth_t& t) {
  const Rotation<frame::R, frame::K> R_r_k(Eigen::Quaterniond(t.q_r_k[0], t.q_r_k[1], t.q_r_k[2], t.q_r_k[3]));
  const auto R_c_r = camera_from_receiver(rig.mount_angles);
  return {R_c_r * R_r_k, Point<frame::C>(R_c_r.rotate(Vec3(t.t_r_k_m[0], t.t_r_k_m[1], t.t_r_k_m[2]) - rig.lens.xyz))};
}

void add_measurement(const FrameOutput& out, const std::vector<TruePoint>& all, FeatureRow& row) {
  row.u = row.v = row.ideal_u = row.ideal_v = kNone;
  row.cov_uu = row.cov_uv = row.cov_vv = row.nis = row.nearest_other = kNone;
  const auto m = find(out.measurements.items, row.id);
  if (m == out.measurements.items.end()) return;
  row.reason = static_cast<std::int8_t>(m->reason);
  if (!m->accepted) return;
  row.measured = 1;
  row.kind = static_cast<std::int8_t>(m->kind);
  row.u = m->raw_px.x();
  row.v = m->raw_px.y();
  row.ideal_u = m->ideal_px.x();
  row.ideal_v = m->ideal_px.y();
  row.cov_uu = static_cast<float>(m->cov_px2(0, 0));
  row.cov_uv = static_cast<float>(m->cov_px2(0, 1));
  row.cov_vv = static_cast<float>(m->cov_px2(1, 1));
  row.nis = static_cast<float>(m->nis);
  row.nearest_other = nearest_other(all, row.id, m->raw_px);
}

/// A structured array in NumPy's file format, version 1.0: magic, length of the header, header, rows.
template <class Row>
Result<> write_npy(const std::vector<Row>& rows, const char* columns, const std::string& path) {
  std::string head = std::string("{'descr': [") + columns + "], 'fortran_order': False, 'shape': (" + std::to_string(rows.size()) + ",), }";
  head.resize((head.size() + 10 + 1 + 63) / 64 * 64 - 11, ' ');
  head += '\n';
  std::ofstream file(path, std::ios::binary);
  file.write("\x93NUMPY\x01\x00", 8);
  const auto n = static_cast<std::uint16_t>(head.size());
  file.put(static_cast<char>(n & 0xFF)).put(static_cast<char>(n >> 8));
  file << head;
  file.write(reinterpret_cast<const char*>(rows.data()), static_cast<std::streamsize>(rows.size() * sizeof(Row)));
  if (!file.flush()) return make_error(ErrorCode::kIo, path, "cannot be written whole");
  return Ok{};
}

nlohmann::json describe(const Rig& rig, std::int64_t first_frame) {
  const Intrinsics& k = rig.camera.intrinsics();
  nlohmann::json j{{"width", k.width}, {"height", k.height}, {"fx", k.fx_px}, {"fy", k.fy_px}, {"cx", k.cx_px}, {"cy", k.cy_px}, {"first_frame", first_frame}};
  for (std::size_t s = 0; s < kStages; ++s) j["stages"].push_back(to_string(static_cast<Stage>(s)));
  for (const Feature& f : rig.tanker.features()) {
    const Vec3 p = rig.tanker.in_body(f).xyz;
    j["features"].push_back({{"id", f.id}, {"name", f.name}, {"enabled", f.enabled}, {"sigma_m", f.sigma_m}, {"p_k", {p.x(), p.y(), p.z()}}});
  }
  return j;
}

}  // namespace

Result<EvaluationTables> EvaluationTables::create(const std::string& flight, std::int64_t first_frame) {
  auto truths = flight_truth(flight);
  if (!truths.ok()) return truths.error();
  auto rig = Rig::load(flight + "/rig.toml");
  if (!rig.ok()) return rig.error();
  EvaluationTables out;
  out.own_ = rig->tanker;
  out.first_frame_ = first_frame;
  for (truth_t& t : *truths) out.truth_.emplace(t.mid_exposure_ns, std::move(t));
  return out;
}

void EvaluationTables::add(const Rig& rig, const FrameOutput& out) {
  if (seen_++ < first_frame_) return;
  FrameRow f;
  f.t_mid_ns = out.in.frame.t_mid.ns;
  f.nav_update = out.in.nav.state.valid ? 1 : 0;
  f.consensus = out.alignment.consensus ? 1 : 0;
  f.nav_suspect = out.nav_suspect ? 1 : 0;
  f.integrity = static_cast<float>(out.measurements.integrity);
  f.range_m = kNone;
  f.chain_us = static_cast<float>(static_cast<double>(out.chain_time.ns) * 1e-3);
  for (std::size_t s = 0; s < kStages; ++s) f.stage_us[s] = static_cast<float>(static_cast<double>(out.stage_time[s].ns) * 1e-3);
  if (const auto found = truth_.find(f.t_mid_ns); found != truth_.end()) {
    const truth_t& t = found->second;
    f.has_truth = 1;
    f.has_pose = t.has_pose ? 1 : 0;
    std::vector<TruePoint> points = stated(t);
    align::CameraPose start = out.alignment.consensus ? out.alignment.T_c_k : last_;
    if (t.has_pose) {
      start = through_mount(rig, t);
      const Eigen::Quaterniond q = start.rotation().quaternion();
      f.range_m = static_cast<float>(start.translation().xyz.norm());
      std::copy(start.translation().xyz.data(), start.translation().xyz.data() + 3, f.pose_t);
      const double w[4] = {q.w(), q.x(), q.y(), q.z()};
      std::copy(w, w + 4, f.pose_q);
    }
    if (const auto pose = true_pose(rig.camera, own_, t, start)) {
      last_ = pose->T_c_k;
      add_learnt(rig, pose->T_c_k, points);
    }
    for (const TruePoint& p : points) add_row(out, points, p);
  }
  frames_.push_back(f);
}

void EvaluationTables::add_row(const FrameOutput& out, const std::vector<TruePoint>& all, const TruePoint& point) {
  FeatureRow row;
  row.frame = static_cast<std::int32_t>(frames_.size());
  row.id = point.id;
  row.truth = point.visible;
  row.true_u = point.uv_px.x();
  row.true_v = point.uv_px.y();
  row.true_ideal_u = point.ideal_px.x();
  row.true_ideal_v = point.ideal_px.y();
  add_prediction(out, row);
  add_tracks(out, row);
  add_measurement(out, all, row);
  features_.push_back(row);
}

Result<> EvaluationTables::write(const Rig& rig, const std::string& folder) const {
  CYCLOPS_TRY(write_npy(features_, kFeatureColumns, folder + "/features.npy"));
  CYCLOPS_TRY(write_npy(frames_, kFrameColumns, folder + "/frames.npy"));
  std::ofstream file(folder + "/rig.json");
  file << describe(rig, first_frame_).dump(1) << "\n";
  if (!file.flush()) return make_error(ErrorCode::kIo, folder + "/rig.json", "cannot be written");
  return Ok{};
}

}  // namespace cyclops::tools
