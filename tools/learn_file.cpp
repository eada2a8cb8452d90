#include "tools/learn_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>

namespace cyclops::tools::learn {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

std::string text_of(double v) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.17g", v);
  return buffer;
}

std::string quoted(const std::string& s) {
  if (s.find_first_of(",\"") == std::string::npos) return s;
  std::string out = "\"";
  for (char c : s) out.append(c == '"' ? 2 : 1, c);
  out += '"';
  return out;
}

std::string joined(std::initializer_list<double> values) {
  std::string out;
  for (double v : values) {
    if (!out.empty()) out += ' ';
    out += text_of(v);
  }
  return out;
}

std::string normals_of(const Feature& f) {
  std::string out;
  for (const Vec3& n : f.normals_m) {
    if (!out.empty()) out += "; ";
    out += joined({n.x(), n.y(), n.z()});
  }
  return out;
}

/// The model's axes from the body's.
Vec3 in_model(const TankerModel& tanker, const Point<frame::K>& p_k) { return tanker.ins().xyz + TankerModel::direction_in_body(p_k.xyz); }

Mat3 covariance_in_model(const Mat3& cov_k) {
  const Mat3 D = Vec3(-1, 1, -1).asDiagonal();
  return D * cov_k * D;
}

double nearest_survey_px(const Learnt& learnt, const LearntPoint& p) {
  double least = 1e9;
  const View& view = learnt.views.views[static_cast<std::size_t>(p.sights[p.sights.size() / 2].view)];
  const auto at = view.camera->project(view.T_c_k * p.p_k);
  for (const Feature& f : learnt.views.tanker.features())
    if (const auto there = view.camera->project(view.T_c_k * learnt.views.tanker.in_body(f)); f.enabled && at && there) least = std::min(least, (*at - *there).norm());
  return least;
}

std::string survey_line(const Feature& f, double unit, bool enabled) {
  const Vec3 p = f.p_m.xyz / unit;
  return std::to_string(f.id) + "," + quoted(f.name) + "," + text_of(p.x()) + "," + text_of(p.y()) + "," + text_of(p.z()) + "," + quoted(f.kind) + "," +
         normals_of(f) + "," + text_of(f.sigma_m / unit) + "," + (enabled ? "1" : "0") + ",,,,surveyed\n";
}

std::string learnt_line(const Learnt& learnt, const ChosenPoint& c, std::int32_t id) {
  const double unit = learnt.views.metres_per_unit;
  const TankerModel& tanker = learnt.views.tanker;
  const Vec3 p = in_model(tanker, c.point.p_k) / unit;
  const Mat3 C = covariance_in_model(c.point.cov_m2) / (unit * unit);
  const SeenFrom& s = c.seen_from;
  std::string name = "learnt " + std::to_string(id);
  if (c.point.survey >= 0) name += " near " + std::to_string(tanker.features()[static_cast<std::size_t>(c.point.survey)].id);
  char how[160];
  std::snprintf(how, sizeof how, "%zu sights; strength %.2f; scatter %.2f px; drift %.2f px", c.point.sights.size(), c.point.strength, c.point.scatter_px, c.point.drift_px);
  return std::to_string(id) + "," + name + "," + text_of(p.x()) + "," + text_of(p.y()) + "," + text_of(p.z()) + ",learnt,," + text_of(std::sqrt(C.trace() / 3)) + ",1," +
         joined({C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2)}) + "," +
         joined({s.axis_m.x(), s.axis_m.y(), s.axis_m.z(), std::acos(std::clamp(s.least_cosine, -1.0, 1.0)) / kDeg}) + "," + joined({s.least_m / unit, s.most_m / unit}) + "," +
         how + "\n";
}

std::int32_t first_id(const TankerModel& tanker) {
  std::int32_t most = 0;
  for (const Feature& f : tanker.features()) most = std::max(most, f.id);
  return (most / 1000 + 1) * 1000;
}

}  // namespace

std::string model_csv(const Learnt& learnt, Mix mix, double apart_px) {
  std::string out = "# Learnt from";
  for (const std::string& f : learnt.views.flights) out += " " + std::filesystem::path(f).filename().string();
  out += " by cyclops-learn " CYCLOPS_VERSION "; surveyed features ";
  out += mix == Mix::kReplace ? "switched off.\n" : "stay.\n";
  out += "id,name,x,y,z,kind,normals,sigma,enabled,cov,seen_from,seen_range,provenance\n";
  for (const Feature& f : learnt.views.tanker.features()) out += survey_line(f, learnt.views.metres_per_unit, f.enabled && mix == Mix::kAdd);
  std::int32_t id = first_id(learnt.views.tanker);
  for (const ChosenPoint& c : learnt.points)
    if (mix == Mix::kReplace || nearest_survey_px(learnt, c.point) >= apart_px) out += learnt_line(learnt, c, id++);
  return out;
}

std::string strength_json(const Learnt& learnt) {
  nlohmann::json points = nlohmann::json::array();
  for (const ChosenPoint& c : learnt.points) {
    nlohmann::json by_range = nlohmann::json::array();
    for (const Strength& s : c.strength)
      by_range.push_back({{"flight", std::filesystem::path(learnt.views.flights[static_cast<std::size_t>(s.flight)]).filename().string()},
                          {"range_m", {s.least_m, s.most_m}}, {"expected", s.expected}, {"found", s.found}, {"rms_px", s.rms_px}});
    const Vec3 p = in_model(learnt.views.tanker, c.point.p_k) / learnt.views.metres_per_unit;
    points.push_back({{"model", {p.x(), p.y(), p.z()}}, {"sights", c.point.sights.size()}, {"strength", c.point.strength}, {"scatter_px", c.point.scatter_px},
                      {"drift_px", c.point.drift_px}, {"inflation", c.point.inflation},
                      {"survey", c.point.survey < 0 ? -1 : learnt.views.tanker.features()[static_cast<std::size_t>(c.point.survey)].id}, {"by_range", by_range}});
  }
  const nlohmann::json j = {{"flights", learnt.views.flights}, {"views", learnt.views.views.size()}, {"followed", learnt.followed}, {"points", points}};
  return j.dump(1) + "\n";
}

Result<> write_text(const std::string& path, const std::string& text) {
  const std::string part = path + ".part";
  std::ofstream file(part, std::ios::binary);
  file << text;
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(part, path, error);
  if (!file || error) return make_error(ErrorCode::kIo, path, "cannot be written");
  return Ok{};
}

}  // namespace cyclops::tools::learn
